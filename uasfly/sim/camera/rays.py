"""The ray of every pixel through the camera's full distortion model, worked out once per camera."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from uasfly.camera import Camera
from uasfly.messages import Array

NEAREST_M = 0.02  # nothing nearer to the lens is drawn
COARSE_PX = 8  # what changes slowly over the picture is worked out once for so many rows and columns
_STEPS_PER_EDGE = 8
_NOWHERE = 1e6  # where pixels look that no ray in front comes from

Region = tuple[int, int, int, int]


class RayTable:
    """Rays of a camera's pixels.

    Args:
        camera: the camera.

    Attributes:
        camera: the camera.
        plane: (height, width, 2) float32, where each ray meets the plane z = 1 of the camera's axes.
        valid: (height, width), whether a ray in front comes there at all.
    """

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        height, width = camera.height_px, camera.width_px
        x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
        plane = camera.normalise(np.column_stack((x.ravel(), y.ravel())))
        valid = np.isfinite(plane).all(axis=1)
        self._low, self._high = plane[valid].min(axis=0), plane[valid].max(axis=0)
        plane[~valid] = _NOWHERE
        self.plane: NDArray[np.float32] = plane.reshape(height, width, 2).astype(np.float32)
        self.valid = valid.reshape(height, width)

    @cached_property
    def by_column(self) -> NDArray[np.float32]:
        """(height, width, 2): change of `plane` from one column to the next."""
        return np.asarray(np.gradient(self.plane, axis=1), dtype=np.float32)

    @cached_property
    def by_row(self) -> NDArray[np.float32]:
        """(height, width, 2): change of `plane` from one row to the next."""
        return np.asarray(np.gradient(self.plane, axis=0), dtype=np.float32)

    @cached_property
    def coarse(self) -> Array:
        """(rows, columns, 2): `plane` amid each block of COARSE_PX by COARSE_PX pixels, and one block beyond."""
        height, width = self.camera.height_px, self.camera.width_px
        x, y = (
            np.arange(-1, -(-size // COARSE_PX) + 1) * COARSE_PX + 0.5 * (COARSE_PX - 1) for size in (width, height)
        )
        pixels = np.column_stack([axis.ravel() for axis in np.meshgrid(x, y)])
        plane = self.camera.normalise(pixels)
        plane[~np.isfinite(plane).all(axis=1)] = _NOWHERE
        return plane.reshape(len(y), len(x), 2)

    def region(self, polygon_in_camera: Array, margin_px: float) -> Region | None:
        """The part of the picture that a flat polygon can be seen in, as x0, y0, x1, y1; None where it is not seen.

        Args:
            polygon_in_camera: (n, 3) m, camera axes; it may reach behind the camera.
            margin_px: added on all sides.
        """
        (x_low, y_low), (x_high, y_high) = self._low, self._high
        polygon = polygon_in_camera
        for normal, offset in (
            ((0.0, 0.0, 1.0), NEAREST_M),
            ((1.0, 0.0, -x_low), 0.0),
            ((-1.0, 0.0, x_high), 0.0),
            ((0.0, 1.0, -y_low), 0.0),
            ((0.0, -1.0, y_high), 0.0),
        ):
            polygon = _clip(polygon, np.array(normal), offset)
            if len(polygon) < 3:
                return None
        shares = np.arange(_STEPS_PER_EDGE)[:, None, None] / _STEPS_PER_EDGE
        outline = (polygon + shares * (np.roll(polygon, -1, axis=0) - polygon)).reshape(-1, 3)
        pixels = self.camera.project(outline)
        low = np.floor(pixels.min(axis=0) - margin_px)
        high = np.ceil(pixels.max(axis=0) + margin_px) + 1.0
        x0, y0 = (max(0, int(value)) for value in low)
        x1, y1 = min(self.camera.width_px, int(high[0])), min(self.camera.height_px, int(high[1]))
        return (x0, y0, x1, y1) if x1 > x0 and y1 > y0 else None


def _clip(polygon: Array, normal: Array, offset: float) -> Array:
    """What of a polygon (n, 3) is on the side normal . point >= offset (Sutherland & Hodgman 1974)."""
    height = polygon @ normal - offset
    kept: list[Array] = []
    for here, there, above, next_above in zip(
        polygon, np.roll(polygon, -1, axis=0), height, np.roll(height, -1), strict=True
    ):
        if above >= 0.0:
            kept.append(here)
        if (above >= 0.0) != (next_above >= 0.0):
            kept.append(here + above / (above - next_above) * (there - here))
    return np.array(kept).reshape(-1, 3)
