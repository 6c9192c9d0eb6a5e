"""Marker poses with the errors that a detector makes, without a picture.

The error of a pose follows from that of the corners through the derivative of the projection. How large the corners'
error is, and from where on no marker is found, are figures measured on rendered frames; a test holds them to those.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.frames import quaternion_from_rotation_vector, quaternion_inverse, quaternion_product, skew
from uasfly.messages import Array, MarkerSample
from uasfly.sim.camera.optics import hidden_part
from uasfly.sim.camera.placement import PlacedBundle
from uasfly.sim.camera.printed import marker_cells
from uasfly.sim.camera.settings import CameraSettings
from uasfly.sim.camera.shutter import Exposure


@dataclass(frozen=True, slots=True)
class DetectorFigures:
    """What a detector does, as measured on rendered frames with the default noise and lens blur.

    With c the size of a marker's cell and b the motion blur [px], the error of a corner on each axis is
    hypot(floor_px, corner_px / c^2) * (1 + blur_growth * (b/c)^2) [px]; a marker is found with the probability
    1 / (1 + exp(-(c - found_cell_px - found_per_blur * b) / found_width_px)).
    """

    floor_px: float = 0.008
    corner_px: float = 0.55
    blur_growth: float = 0.6
    found_cell_px: float = 1.4
    found_per_blur: float = 0.23
    found_width_px: float = 0.12
    least_cosine: float = 0.2  # of the angle between a marker's normal and the line of sight

    def sigma_px(self, cell_px: float, blur_px: float) -> float:
        """Error of a corner [px], an axis."""
        sharp = math.hypot(self.floor_px, self.corner_px / cell_px**2)
        return sharp * (1.0 + self.blur_growth * (blur_px / cell_px) ** 2)

    def probability(self, cell_px: float, blur_px: float) -> float:
        """Of being found."""
        excess = (cell_px - self.found_cell_px - self.found_per_blur * blur_px) / self.found_width_px
        return 1.0 / (1.0 + math.exp(-min(max(excess, -50.0), 50.0)))


class NoiseModelCamera:
    """Stands for picture, detector and pose solver.

    Args:
        camera: its file. bundle: what it looks at.
        settings: the scenario's section `camera`.
        rng: of everything random.
        figures: the detector's.
    """

    def __init__(
        self,
        camera: Camera,
        bundle: Bundle,
        settings: CameraSettings,
        rng: np.random.Generator,
        figures: DetectorFigures = DetectorFigures(),
    ) -> None:
        self._rng = rng
        self._camera, self._bundle, self._settings, self._figures = camera, bundle, settings, figures
        self._exposure_s = settings.open_s(camera)
        self._placed = PlacedBundle(settings.bundle)
        self._cells = {marker.id: len(marker_cells(bundle.family, marker.id)) for marker in bundle.markers}

    def see(self, exposure: Exposure) -> MarkerSample | None:
        """The bundle's pose in one exposure with errors drawn; None where no marker is found."""
        position, bundle_to_world = self._placed.pose(exposure.since_s)
        to_camera = exposure.motion.rotation_camera_to_world.T
        rotation = to_camera @ bundle_to_world
        place = to_camera @ (position - exposure.motion.position_in_world)
        seen = self._seen(exposure, rotation, place)
        if not seen:
            return None
        information, stated = np.zeros((6, 6)), np.zeros((6, 6))
        for marker_id, sigma_px in seen:
            points = self._bundle.corners(marker_id)
            _, by_point = self._camera.project_with_jacobian(points @ rotation.T + place)
            by_turn = by_point @ (-rotation @ np.array([skew(point) for point in points]))
            rows = np.concatenate((by_point, by_turn), axis=2).reshape(-1, 6)
            information += rows.T @ rows / sigma_px**2
            stated += rows.T @ rows / max(sigma_px, self._camera.pixel_sigma) ** 2
        # information = L L': the inverse of L' makes errors of this covariance
        error = np.linalg.solve(np.linalg.cholesky(information).T, self._rng.standard_normal(6))
        return self._sample(exposure.exposed_s, rotation, place, error, np.asarray(np.linalg.inv(stated), dtype=float))

    def _sample(self, exposed_s: float, rotation: Array, place: Array, error: Array, covariance: Array) -> MarkerSample:
        """The pose as the solver tells it: through the mounting that the camera's file says."""
        camera, mounting = self._camera, self._camera.transform_camera_to_body
        turned = quaternion_product(mounting.unit_quaternion, _quaternion(rotation))
        wrong = quaternion_inverse(quaternion_from_rotation_vector(error[3:]))
        to_body = np.eye(6)
        to_body[:3, :3] = mounting.rotation
        by_turn = np.vstack((-mounting.rotation @ skew(place), rotation.T))
        total = to_body @ covariance @ to_body.T
        total += math.radians(camera.mounting_sigma_deg) ** 2 * by_turn @ by_turn.T
        total[:3, :3] += camera.mounting_sigma_m**2 * np.eye(3)
        return MarkerSample(
            exposed_s,
            self._bundle.marker_id,
            mounting.position + mounting.rotation @ (place - error[:3]),
            quaternion_product(turned, wrong),
            0.5 * (total + total.T),
        )

    def _seen(self, exposure: Exposure, rotation: Array, place: Array) -> Sequence[tuple[int, float]]:
        """Markers that are found, and the error of their corners [px]."""
        figures, camera = self._figures, self._camera
        half_s = 0.5 * self._exposure_s
        seen: list[tuple[int, float]] = []
        for marker in self._bundle.markers:
            points = marker.corners @ rotation.T + place
            normal, centre = rotation @ marker.rotation[:, 2], rotation @ marker.position + place
            if -(normal @ centre) < figures.least_cosine * np.linalg.norm(centre):
                continue
            pixels = camera.project(points)
            if not self._in_sight(pixels, exposure.since_s):
                continue
            sides = np.linalg.norm(np.roll(pixels, -1, axis=0) - pixels, axis=1)
            cell_px = float(sides.min()) / self._cells[marker.id]
            ends = [self._displaced(exposure, points, offset_s) for offset_s in (-half_s, half_s)]
            blur_px = float(np.linalg.norm(camera.project(ends[1]) - camera.project(ends[0]), axis=1).max())
            if math.isfinite(blur_px) and self._rng.random() < figures.probability(cell_px, blur_px):
                seen.append((marker.id, figures.sigma_px(cell_px, blur_px)))
        return seen

    def _displaced(self, exposure: Exposure, points: Array, offset_s: float) -> Array:
        """Points (n, 3) [m, camera axes] of mid-exposure as they are seen `offset_s` later."""
        motion = exposure.motion
        position, to_world = motion.at(offset_s)
        in_world = points @ motion.rotation_camera_to_world.T + motion.position_in_world
        moved: Array = (in_world - position) @ to_world
        return moved

    def _in_sight(self, pixels: Array, since_s: float) -> bool:
        width, height = self._camera.width_px, self._camera.height_px
        x, y = pixels.T
        if not (x.min() > 1.0 and y.min() > 1.0 and x.max() < width - 2.0 and y.max() < height - 2.0):  # NaN too
            return False
        for occlusion in self._settings.occlusions:
            if occlusion.start_s <= since_s < occlusion.end_s:
                columns, rows = hidden_part(occlusion, width, height)
                if ((x >= columns.start) & (x < columns.stop) & (y >= rows.start) & (y < rows.stop)).any():
                    return False
        return True


def _quaternion(rotation: Array) -> Array:
    """Unit quaternion (4,) of a rotation matrix (3, 3)."""
    import cv2

    vector, _ = cv2.Rodrigues(rotation)
    return quaternion_from_rotation_vector(np.asarray(vector, dtype=float).ravel())
