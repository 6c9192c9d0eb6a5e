"""Pose of a rigid set of points from their pixels: Gauss-Newton with a robust loss, and its covariance.

The pose's error is a position [m, camera axes] and a rotation [rad, marker axes: true = estimate * exp(error)], the
convention of MarkerSample. The derivative of a pixel is that of the projection times [I, -R skew(X)].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.camera import Camera
from uasfly.frames import (
    quaternion_from_rotation_vector,
    quaternion_inverse,
    quaternion_product,
    rotation_matrix,
    rotation_vector_from_quaternion,
)
from uasfly.messages import Array

_HUBER = 3.0  # residuals beyond, in sigmas, count linearly
_STEPS = 30
_CONVERGED = 1e-6  # of metres and radians
_NO_GAIN = 1e-6  # of the cost
_PRIOR_WEIGHT = 8.0  # how many residuals' worth the stated sigmas are trusted
_LEAST_SCALE = 0.25


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a marker frame is.

    Attributes:
        position: (3,) m, marker origin in camera (or body) axes.
        quaternion: (4,) marker to camera (or body).
    """

    position: Array
    quaternion: Array

    @property
    def rotation(self) -> Array:
        """(3, 3) marker to camera."""
        return rotation_matrix(self.quaternion)

    def points(self, points_in_marker: Array) -> Array:
        """Points (n, 3) m of the marker frame, in camera axes."""
        moved: Array = points_in_marker @ self.rotation.T + self.position
        return moved

    def moved(self, error: Array) -> Pose:
        """The pose with an error (6,) applied: position [m, camera axes], rotation [rad, marker axes]."""
        turned = quaternion_product(self.quaternion, quaternion_from_rotation_vector(error[3:]))
        return Pose(self.position + error[:3], turned / np.linalg.norm(turned))

    def minus(self, other: Pose) -> Array:
        """The error (6,) that takes `other` to this pose: `other.moved(self.minus(other))` is this pose."""
        turn = rotation_vector_from_quaternion(
            quaternion_product(quaternion_inverse(other.quaternion), self.quaternion)
        )
        return np.concatenate((self.position - other.position, turn))

    def of_frame(self, inner: Pose) -> Pose:
        """Pose of a frame that is at `inner` in this pose's frame."""
        turned = quaternion_product(self.quaternion, inner.quaternion)
        return Pose(self.points(inner.position[None])[0], turned / np.linalg.norm(turned))

    @property
    def inverse(self) -> Pose:
        """Pose of the camera in the marker's frame."""
        return Pose(-self.rotation.T @ self.position, quaternion_inverse(self.quaternion))


@dataclass(frozen=True, slots=True)
class PoseFit:
    """A fitted pose.

    Attributes:
        pose: of the marker frame in camera axes.
        covariance: (6, 6) of its error.
        residuals_px: (n, 2) pixel minus projection.
        scale: factor on the stated sigmas that the residuals ask for.
    """

    pose: Pose
    covariance: Array
    residuals_px: Array
    scale: float


def pixel_residuals(camera: Camera, pose: Pose, points: Array, pixels: Array) -> tuple[Array, Array]:
    """Residuals (n, 2) [px], pixel minus projection, and the projection's derivative (n, 2, 6) by the pose's error.

    Args:
        camera: the lens.
        pose: of the marker frame in camera axes.
        points: (n, 3) m, marker frame.
        pixels: (n, 2) px.
    """
    rotation = pose.rotation
    projected, by_point = camera.project_with_jacobian(points @ rotation.T + pose.position)
    x, y, z = points.T
    zero = np.zeros_like(x)
    skew = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), axis=-1).reshape(-1, 3, 3)
    return pixels - projected, np.concatenate((by_point, -by_point @ (rotation @ skew)), axis=2)


def fit_pose(camera: Camera, start: Pose, points: Array, pixels: Array, sigma_px: Array) -> PoseFit | None:
    """Pose that fits the pixels best, from a start nearby.

    The covariance is s^2 (J'WJ)^-1; s^2 is the residuals' mean square in units of the stated variances, together with
    as much trust in these as _PRIOR_WEIGHT residuals have: four corners leave two residuals over, too few alone.

    Args:
        camera: the lens.
        start: near the solution.
        points: (n, 3) m, marker frame, n >= 3.
        pixels: (n, 2) px.
        sigma_px: (n,) standard deviation of a pixel, an axis.

    Returns:
        None where the points end behind the camera or do not determine the pose.
    """
    pose, damping = start, 0.0
    residuals, jacobian = pixel_residuals(camera, pose, points, pixels)
    cost = _cost(residuals, sigma_px)
    if not np.isfinite(cost):
        return None
    for _ in range(_STEPS):
        normal, gradient = _normal_equations(residuals, jacobian, sigma_px)
        try:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
        except np.linalg.LinAlgError:
            return None
        trial = pose.moved(np.asarray(step, dtype=float))
        trial_residuals, trial_jacobian = pixel_residuals(camera, trial, points, pixels)
        trial_cost = _cost(trial_residuals, sigma_px)
        if float(np.abs(step).max()) < _CONVERGED and not trial_cost < cost:
            break
        if not trial_cost <= cost * (1.0 + 1e-12):
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e6:
                break
            continue
        gain = cost - trial_cost
        pose, residuals, jacobian, cost, damping = trial, trial_residuals, trial_jacobian, trial_cost, 0.1 * damping
        if float(np.abs(step).max()) < _CONVERGED or gain < _NO_GAIN * cost:
            break
    normal, _ = _normal_equations(residuals, jacobian, sigma_px)
    try:
        inverse = np.linalg.inv(normal)
        np.linalg.cholesky(inverse)
    except np.linalg.LinAlgError:
        return None
    freedom = 2.0 * len(points) - 6.0
    square = (_PRIOR_WEIGHT + 2.0 * cost) / (_PRIOR_WEIGHT + freedom)
    scale = max(square, _LEAST_SCALE)
    return PoseFit(pose, scale * 0.5 * (inverse + inverse.T), residuals, float(np.sqrt(scale)))


def _lengths(residuals: Array, sigma_px: Array) -> Array:
    return np.asarray(np.linalg.norm(residuals, axis=1) / sigma_px, dtype=float)


def huber_weights(lengths: Array) -> Array:
    """Weights (n,) that the fit gives to points whose residuals have these lengths, in sigmas."""
    return np.asarray(np.minimum(1.0, _HUBER / np.maximum(lengths, 1e-12)), dtype=float)


def _cost(residuals: Array, sigma_px: Array) -> float:
    """Huber's loss of the residuals' lengths; NaN where a point is behind the camera."""
    length = _lengths(residuals, sigma_px)
    return float(np.where(length <= _HUBER, 0.5 * length**2, _HUBER * (length - 0.5 * _HUBER)).sum())


def _normal_equations(residuals: Array, jacobian: Array, sigma_px: Array) -> tuple[Array, Array]:
    length = _lengths(residuals, sigma_px)
    weight = huber_weights(length) / sigma_px**2
    weighted = jacobian * weight[:, None, None]
    normal: Array = np.einsum("nki,nkj->ij", weighted, jacobian)
    gradient: Array = np.einsum("nki,nk->i", weighted, residuals)
    return normal, gradient
