"""Renders a frame: background, markers, lens, sensor."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.sim.camera.background import BackgroundTexture
from uasfly.sim.camera.marker_painter import MarkerPainter
from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.optics import Image, Lens, Sensor
from uasfly.sim.camera.placement import PlacedBundle
from uasfly.sim.camera.printed import print_markers
from uasfly.sim.camera.rays import COARSE_PX, RayTable
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings

_HORIZON_1_M = 1e-3  # further than a kilometre, or behind the camera, there is no page
_FLAT = np.diag((1.0, 1.0, 0.0))  # (x, y, 1) to a point of the page [m]


class Renderer:
    """Pictures of a bundle as one camera takes them.

    Args:
        camera: the true camera.
        bundle: what is seen.
        settings: where it is, and what it looks like.
        rng: draws background and noise.
        others: more bundles and where they are; nothing hides anything, the later ones are in front.

    Raises:
        UasflyError: the bundle's family cannot be printed.
    """

    def __init__(
        self,
        camera: Camera,
        bundle: Bundle,
        settings: CameraSettings,
        rng: np.random.Generator,
        others: Sequence[tuple[Bundle, BundlePlacement]] = (),
    ) -> None:
        self._rays = RayTable(camera)
        self._exposure_s = settings.open_s(camera)
        self._painter = MarkerPainter(self._rays, self._exposure_s, camera.rolling_shutter_s)
        self._background = BackgroundTexture(settings.background, rng)
        self._lens = Lens(camera, settings, self._rays.valid)
        self._sensor = Sensor(settings.noise, (camera.height_px, camera.width_px), rng)
        self.placed = PlacedBundle(settings.bundle)
        self._printed = [(self.placed, print_markers(bundle, settings.ink, settings.paper))]
        for other, placement in others:
            self._printed.append((PlacedBundle(placement), print_markers(other, settings.ink, settings.paper)))

    def render(self, motion: CameraMotion, since_s: float = -math.inf) -> Image:
        """A frame (height, width), gray.

        Args:
            motion: of the camera at mid-exposure (of the middle row, where the shutter rolls).
            since_s: time on the schedule's clock; negative before it runs.
        """
        picture = self._behind(motion)
        for placed, markers in self._printed:
            position, bundle_to_world = placed.pose(since_s)
            for marker in markers:
                self._painter.paint(picture, marker, motion, position, bundle_to_world)
        return self._sensor.read_out(self._lens.apply(picture, since_s))

    def _behind(self, motion: CameraMotion) -> NDArray[np.float32]:
        """The plane that the page was on at first; beyond its horizon one brightness."""
        camera = self._rays.camera
        if self._background.plain is not None:
            return np.full((camera.height_px, camera.width_px), self._background.plain, dtype=np.float32)
        import cv2

        placed = motion.plane_to_camera(_FLAT, self.placed.first_position, self.placed.first_rotation, 0.0)
        to_page = np.linalg.inv(placed)
        above = self._rays.coarse @ to_page[:, :2].T + to_page[:, 2]
        sky = above[..., 2] < _HORIZON_1_M
        nearness = np.where(sky, _HORIZON_1_M, above[..., 2])
        points = above[..., :2] / nearness[..., None]
        distance = 1.0 / float(np.median(nearness))
        speed = float(np.linalg.norm(motion.velocity_in_world))
        turn = float(np.linalg.norm(motion.angular_rate_in_camera))
        footprint = 2.0 * distance / camera.fx + self._exposure_s * (speed + turn * distance)
        texture, grid, border = self._background.look_up(points, footprint)
        # half the resolution: it is the background
        where = _enlarged(grid, camera)
        half = cv2.remap(
            texture,
            np.ascontiguousarray(where[..., 0]),
            np.ascontiguousarray(where[..., 1]),
            cv2.INTER_LINEAR,
            borderMode=border,
        )
        if sky.any():
            half[_enlarged(sky.astype(np.float32), camera) > 0.0] = self._background.level
        picture = cv2.resize(half, (half.shape[1] * 2, half.shape[0] * 2), interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(picture[: camera.height_px, : camera.width_px], dtype=np.float32)


def _enlarged(coarse: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
    """What is known of coarse blocks (see `RayTable.coarse`) as a picture of half the camera's resolution."""
    import cv2

    step = COARSE_PX // 2
    size = (coarse.shape[1] * step, coarse.shape[0] * step)
    whole = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(whole[step : step + -(-camera.height_px // 2), step : step + -(-camera.width_px // 2)])
