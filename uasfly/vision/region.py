"""Where in the picture to look: around the predicted bundle, and everywhere now and then or when it was not found."""

from __future__ import annotations

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.vision.detectors import Region
from uasfly.vision.pose import Pose

_MARGIN = 0.3  # of the bundle's extent in the picture
_LEAST_MARGIN_PX = 24.0


def predicted_region(camera: Camera, bundle: Bundle, prediction: Pose, sigma_m: float = 0.1) -> Region | None:
    """Part of the picture that holds the bundle.

    Args:
        camera: the lens.
        bundle: which markers.
        prediction: the bundle's pose in camera axes.
        sigma_m: how uncertain its position across the line of sight is; three of these are added on every side.

    Returns:
        None where the bundle is not to be expected in the picture, or fills most of it.
    """
    points = prediction.points(np.concatenate([marker.corners for marker in bundle.markers]))
    if not np.isfinite(points).all() or (points[:, 2] < 0.02).any():
        return None
    pixels = camera.project(points)
    if not np.isfinite(pixels).all() or np.abs(pixels).max() > 1e5:
        return None
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    shift = 3.0 * sigma_m * max(camera.fx, camera.fy) / float(points[:, 2].min())
    margin = max(_LEAST_MARGIN_PX, _MARGIN * float((high - low).max())) + shift
    size = (camera.width_px, camera.height_px)
    left, top = (max(0, int(value - margin)) for value in low)
    right, bottom = (min(limit, int(value + margin) + 1) for value, limit in zip(high, size, strict=True))
    if right - left < 16 or bottom - top < 16 or (right - left) * (bottom - top) > 0.7 * size[0] * size[1]:
        return None
    return Region(left, top, right - left, bottom - top)


class RegionPlan:
    """Decides for each picture whether a region will do.

    Args:
        full_every: every so many pictures the whole one is searched: markers elsewhere and a wrong prediction are seen.
        lost_after: so many misses in a row and the whole picture is searched until the bundle is found.
    """

    def __init__(self, full_every: int = 15, lost_after: int = 2) -> None:
        self._full_every = full_every
        self._lost_after = lost_after
        self._since_full = full_every
        self._misses = lost_after

    def next(self, camera: Camera, bundle: Bundle, prediction: Pose | None, sigma_m: float = 0.1) -> Region | None:
        """Region of the next picture, None for all of it."""
        self._since_full += 1
        region = None
        if prediction is not None and self._since_full < self._full_every and self._misses < self._lost_after:
            region = predicted_region(camera, bundle, prediction, sigma_m)
        if region is None:
            self._since_full = 0
        return region

    def found(self, yes: bool) -> None:
        """What came of the last picture."""
        self._misses = 0 if yes else self._misses + 1
