"""Bundle adjustment: poses of all markers and all pictures from all corners at once (Triggs et al. 2000).

The parameters are six for each picture and each marker but the origin, whose frame the result is in: a position [m]
and a rotation vector [rad] that are applied to the first poses in the convention of `Pose.moved`. A residual is pixel
minus projection, in sigmas. The Jacobian is sparse: a corner depends on one picture and one marker.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.bundle_survey.start import square_corners
from uasfly.vision.detectors import Detection
from uasfly.vision.pose import Pose
from uasfly.vision.rotations import right_jacobians, rotations, skews
from uasfly.vision.square import quaternion_of

_HUBER = 3.0  # residuals beyond, in sigmas, count linearly
_FAR = 1e4  # residual of a corner behind the camera, in sigmas
_POLISH = 5  # steps of Gauss-Newton after the solver, whose inner iteration is loose
_PRIOR_WEIGHT = 8.0  # how many residuals' worth the stated sigmas are trusted


@dataclass(frozen=True, slots=True)
class Observation:
    """One marker in one picture; `view` counts the pictures from 0."""

    view: int
    marker_id: int
    detection: Detection


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The result.

    Attributes:
        markers: poses in the origin's frame, by id.
        views: poses of the origin's frame in camera axes.
        covariances: (6, 6) of each marker's pose, by id: position [m^2, origin's axes], rotation [rad^2, its own axes].
        misfits_px: (n,) RMS distance of each observation's corners from where they should be.
        scale: factor on the stated sigmas that the residuals ask for; the covariances hold it.
    """

    markers: dict[int, Pose]
    views: list[Pose]
    covariances: dict[int, Array]
    misfits_px: Array
    scale: float


class Adjustment:
    """The problem.

    Args:
        camera: the lens.
        observations: what was seen.
        markers: first poses in the origin's frame, by id.
        views: first poses of the origin's frame in camera axes.
        sizes: sides [m] by id.
        origin: id of the marker that stays.
    """

    def __init__(
        self,
        camera: Camera,
        observations: list[Observation],
        markers: dict[int, Pose],
        views: list[Pose],
        sizes: dict[int, float],
        origin: int,
    ) -> None:
        self._camera, self._views, self._markers = camera, views, markers
        self.ids = [origin, *sorted(marker for marker in markers if marker != origin)]
        place = {marker: index for index, marker in enumerate(self.ids)}
        self._view = np.array([observation.view for observation in observations])
        self._marker = np.array([place[observation.marker_id] for observation in observations])
        self._local = np.array([square_corners(sizes[observation.marker_id]) for observation in observations])
        self._pixels = np.array([observation.detection.corners for observation in observations])
        sigma = [max(observation.detection.sigma_px, camera.pixel_sigma) for observation in observations]
        self._sigma = np.array(sigma)[:, None, None]
        poses = [*views, *(markers[marker] for marker in self.ids)]
        self._positions = np.array([pose.position for pose in poses])
        self._rotations = np.array([pose.rotation for pose in poses])
        self.size = 6 * (len(poses) - 1)
        self._pattern = self._columns()

    def residuals(self, x: Array) -> Array:
        """(8 n,) of all observations, in sigmas."""
        return self._evaluate(x, want_jacobian=False)[0]

    def jacobian(self, x: Array) -> csr_matrix:
        """Derivative (8 n, size) of the residuals."""
        blocks = self._evaluate(x, want_jacobian=True)[1]
        rows, columns, kept = self._pattern
        shape = (8 * len(self._view), self.size)
        return csr_matrix((blocks.reshape(-1)[kept], (rows[kept], columns[kept])), shape=shape)

    def solve(self) -> Adjusted:
        """Least squares with Huber's loss, then the covariance of the markers."""
        result = least_squares(
            self.residuals, np.zeros(self.size), jac=self.jacobian, loss="huber", f_scale=_HUBER, x_scale="jac",
            method="trf", tr_solver="lsmr", ftol=1e-9, xtol=1e-9, gtol=1e-9, max_nfev=60,
        )  # fmt: skip
        x = self._polished(np.asarray(result.x, dtype=float))
        residuals = self.residuals(x)
        weights = self._weights(residuals)
        pairs = residuals.reshape(-1, 4, 2) * self._sigma
        misfits = np.sqrt((pairs**2).sum(axis=2).mean(axis=1))
        freedom = max(len(residuals) - self.size, 0)
        scale = (_PRIOR_WEIGHT + float(weights @ residuals**2)) / (_PRIOR_WEIGHT + freedom)
        positions, turned = self._poses(x)
        views = [_pose(positions[i], turned[i]) for i in range(len(self._views))]
        markers = {m: _pose(positions[len(views) + i], turned[len(views) + i]) for i, m in enumerate(self.ids)}
        covariances = self._covariances(self.jacobian(x), weights, scale)
        return Adjusted(markers, views, covariances, misfits, float(np.sqrt(scale)))

    def _polished(self, x: Array) -> Array:
        for _ in range(_POLISH):
            residuals = self.residuals(x)
            cost = _huber(residuals)
            jacobian = self.jacobian(x)
            weighted = jacobian.multiply(self._weights(residuals)[:, None]).tocsr()
            normal = (weighted.T @ jacobian).tocsc()
            try:
                step = splu(normal).solve(-(weighted.T @ residuals))
            except RuntimeError:  # singular
                break
            if not _huber(self.residuals(x + step)) <= cost:
                break
            x = x + step
            if np.abs(step).max() < 1e-9:
                break
        return x

    @staticmethod
    def _weights(residuals: Array) -> Array:
        return np.asarray(np.minimum(1.0, _HUBER / np.maximum(np.abs(residuals), 1e-12)), dtype=float)

    def _covariances(self, jacobian: csr_matrix, weights: Array, scale: float) -> dict[int, Array]:
        """Of the markers alone: pictures are taken out of the normal equations block by block (Schur)."""
        normal = (jacobian.multiply(weights[:, None]).T @ jacobian).tocsr()
        split = 6 * len(self._views)
        rest = normal[split:, split:].toarray()
        for start in range(0, split, 6):
            block = normal[start : start + 6, start : start + 6].toarray()
            across = normal[start : start + 6, split:].toarray()
            rest -= across.T @ np.linalg.solve(block, across)
        covariance = scale * np.linalg.pinv(0.5 * (rest + rest.T), hermitian=True)
        found = {self.ids[0]: np.zeros((6, 6))}
        for index, marker in enumerate(self.ids[1:]):
            part = slice(6 * index, 6 * index + 6)
            found[marker] = covariance[part, part]
        return found

    def _poses(self, x: Array) -> tuple[Array, Array]:
        """Positions (k, 3) and rotations (k, 3, 3) of pictures and then markers."""
        errors = self._errors(x)
        return self._positions + errors[:, :3], self._rotations @ rotations(errors[:, 3:])

    def _errors(self, x: Array) -> Array:
        """(k, 6) of pictures, the origin and the other markers."""
        count = len(self._views)
        free = x.reshape(-1, 6)
        return np.concatenate((free[:count], np.zeros((1, 6)), free[count:]))

    def _evaluate(self, x: Array, want_jacobian: bool) -> tuple[Array, Array]:
        positions, turned = self._poses(x)
        view, marker = self._view, self._marker + len(self._views)
        in_bundle = self._local @ turned[marker].transpose(0, 2, 1) + positions[marker][:, None]
        in_camera = in_bundle @ turned[view].transpose(0, 2, 1) + positions[view][:, None]
        pixels, by_point = self._camera.project_with_jacobian(in_camera.reshape(-1, 3), want_jacobian=want_jacobian)
        residuals = (self._pixels - pixels.reshape(-1, 4, 2)) / self._sigma
        behind = ~np.isfinite(residuals)
        residuals = np.where(behind, _FAR, residuals).reshape(-1)
        if not want_jacobian:
            return residuals, np.empty(0)
        slope = -np.nan_to_num(by_point).reshape(-1, 4, 2, 3) / self._sigma[..., None]
        slope[behind.any(axis=2)] = 0.0
        right = right_jacobians(self._errors(x)[:, 3:])
        by_view = -slope @ turned[view][:, None] @ skews(in_bundle) @ right[view][:, None]
        by_place = slope @ turned[view][:, None]
        by_turn = -by_place @ turned[marker][:, None] @ skews(self._local) @ right[marker][:, None]
        return residuals, np.concatenate((slope, by_view, by_place, by_turn), axis=3)

    def _columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Row, column and whether it is one of the problem's, of each entry of the blocks (n, 4, 2, 12)."""
        count = len(self._view)
        rows = np.repeat(np.arange(8 * count), 12)
        first = 6 * self._view
        second = 6 * (len(self._views) + self._marker - 1)
        each = np.concatenate((first[:, None] + np.arange(6), second[:, None] + np.arange(6)), axis=1)
        columns = np.repeat(each, 8, axis=0).reshape(-1)
        kept = np.repeat(np.column_stack((np.ones((count, 6)), np.repeat((self._marker > 0)[:, None], 6, 1))), 8, 0)
        return rows.astype(np.intp), columns.astype(np.intp), kept.reshape(-1).astype(np.bool_)


def _huber(residuals: Array) -> float:
    size = np.abs(residuals)
    return float(np.where(size <= _HUBER, 0.5 * size**2, _HUBER * (size - 0.5 * _HUBER)).sum())


def _pose(position: Array, rotation: Array) -> Pose:
    return Pose(position, quaternion_of(rotation))
