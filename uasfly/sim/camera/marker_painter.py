"""Paints a printed marker into a picture: exact means over each pixel's footprint, moved through the exposure."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array
from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.printed import PrintedMarker
from uasfly.sim.camera.rays import COARSE_PX, RayTable, Region

Picture = NDArray[np.float32]
_Placing = Callable[[float], Array]  # an offset [s] to the (3, 3) from (u, v, 1) to camera axes [m]

MOST_SUBEXPOSURES = 16
_BLUR_PER_SUBEXPOSURE_PX = 1.0
_LEAST_COSINE = 0.03  # a page seen more from the side than this shows nothing
_ROLLING_STEP_S = 1e-3


class MarkerPainter:
    """Paints markers of one camera.

    Args:
        rays: the camera's.
        exposure_s: time the shutter is open, for each row.
        rolling_shutter_s: from the first row's exposure to the last row's.
    """

    def __init__(self, rays: RayTable, exposure_s: float, rolling_shutter_s: float) -> None:
        self._rays = rays
        self._exposure_s = exposure_s
        height = rays.camera.height_px
        rows = (np.arange(height) - 0.5 * (height - 1)) / max(height - 1, 1)
        self._row_offset_s = (rolling_shutter_s * rows).astype(np.float32) if rolling_shutter_s else None

    def paint(
        self,
        picture: Picture,
        marker: PrintedMarker,
        motion: CameraMotion,
        bundle_position: Array,
        bundle_to_world: Array,
    ) -> bool:
        """Paint a marker over what the picture holds; whether any of it is in the picture.

        Args:
            picture: (height, width), 0..1; it is changed.
            marker: the marker.
            motion: of the camera.
            bundle_position: (3,) m, world.
            bundle_to_world: (3, 3).
        """

        def cells_to_camera(offset_s: float) -> Array:
            return motion.plane_to_camera(marker.cells_to_bundle, bundle_position, bundle_to_world, offset_s)

        middle = cells_to_camera(0.0)
        centre = middle @ (0.5 * len(marker.sums) - 0.5, 0.5 * len(marker.sums) - 0.5, 1.0)
        facing = -float(np.cross(middle[:, 0], -middle[:, 1]) @ centre)
        size = float(np.linalg.norm(middle[:, 0]) * np.linalg.norm(middle[:, 1]))
        if facing < _LEAST_COSINE * size * float(np.linalg.norm(centre)):
            return False
        blur_px = self._travel_px(marker, cells_to_camera)
        rolling_s = 0.0 if self._row_offset_s is None else float(self._row_offset_s[-1])
        outline = np.array([(u, v, 1.0) for u, v in _square(marker.first, marker.last)])
        region = self._rays.region(outline @ middle.T, 2.0 + blur_px * (0.5 + rolling_s / max(self._exposure_s, 1e-3)))
        if region is None:
            return False
        count = min(MOST_SUBEXPOSURES, max(1, math.ceil(blur_px / _BLUR_PER_SUBEXPOSURE_PX)))
        times = [self._exposure_s * ((part + 0.5) / count - 0.5) for part in range(count)]
        light, cover = self._mean(marker, region, cells_to_camera, times[0])
        for offset_s in times[1:]:
            more_light, more_cover = self._mean(marker, region, cells_to_camera, offset_s)
            light += more_light
            cover += more_cover
        x0, y0, x1, y1 = region
        part = picture[y0:y1, x0:x1]
        scale = np.float32(1.0 / count)
        part *= np.float32(1.0) - scale * cover
        part += scale * light
        return True

    def _travel_px(self, marker: PrintedMarker, cells_to_camera: _Placing) -> float:
        """How far the marker's corners move in the picture during the exposure [px], at most."""
        outline = np.array([(u, v, 1.0) for u, v in _square(marker.first, marker.last)])
        half_s = 0.5 * max(self._exposure_s, 1e-3)
        start, end = (outline @ cells_to_camera(offset).T for offset in (-half_s, half_s))
        seen = (start[:, 2] > 1e-3) & (end[:, 2] > 1e-3)
        if not seen.any():
            return 0.0
        slide = start[seen, :2] / start[seen, 2:] - end[seen, :2] / end[seen, 2:]
        focal = max(self._rays.camera.fx, self._rays.camera.fy)
        return float(focal * np.linalg.norm(slide, axis=1).max()) * self._exposure_s / (2.0 * half_s)

    def _mean(
        self, marker: PrintedMarker, region: Region, cells_to_camera: _Placing, offset_s: float
    ) -> tuple[Picture, Picture]:
        """Light of the marker and share of the pixel that it covers, for the pixels of a region."""
        to_cells = _inverse(cells_to_camera(offset_s))
        half_u, half_v = self._half_footprints(region, to_cells)
        u, v = self._cells(region, to_cells, cells_to_camera, offset_s)
        first, last = marker.first, marker.last
        u0, u1 = _clipped(u - half_u, first, last), _clipped(u + half_u, first, last)
        v0, v1 = _clipped(v - half_v, first, last), _clipped(v + half_v, first, last)
        light = _look_up(marker.sums, u1, v1)
        light -= _look_up(marker.sums, u0, v1)
        light -= _look_up(marker.sums, u1, v0)
        light += _look_up(marker.sums, u0, v0)
        area = np.float32(4.0) * half_u * half_v
        cover = (u1 - u0) * (v1 - v0) / area
        light /= area
        light += np.float32(marker.level) * cover
        return light, cover

    def _cells(
        self, region: Region, to_cells: Array, cells_to_camera: _Placing, offset_s: float
    ) -> tuple[Picture, Picture]:
        """Where each pixel looks, u and v [cells]; far outside the marker where that is behind the camera."""
        import cv2

        x0, y0, x1, y1 = region
        rays = self._rays.plane[y0:y1, x0:x1]
        if self._row_offset_s is None:
            if _all_in_front(rays, to_cells):
                cells = np.asarray(cv2.perspectiveTransform(rays, to_cells), dtype=np.float32)
                return np.ascontiguousarray(cells[..., 0]), np.ascontiguousarray(cells[..., 1])
            above = np.asarray(cv2.transform(rays, to_cells), dtype=np.float32)
        else:
            step = _ROLLING_STEP_S
            later, earlier = (_inverse(cells_to_camera(offset_s + sign * step)) for sign in (1.0, -1.0))
            drift = np.asarray(cv2.transform(rays, (later - earlier) / (2.0 * step)), dtype=np.float32)
            above = np.asarray(cv2.transform(rays, to_cells), dtype=np.float32)
            above += self._row_offset_s[y0:y1, None, None] * drift
        behind = above[..., 2] <= 1e-6
        nearness = np.where(behind, np.float32(1.0), above[..., 2])
        u = np.asarray(above[..., 0] / nearness, dtype=np.float32)
        v = np.asarray(above[..., 1] / nearness, dtype=np.float32)
        u[behind] = -1e6
        return u, v

    def _half_footprints(self, region: Region, to_cells: Array) -> tuple[Picture, Picture]:
        """Half the sides of the rectangle of cells whose mean a pixel sees.

        A pixel sees a parallelogram; the rectangle has the same variance along u and along v.
        """
        import cv2

        x0, y0, x1, y1 = region
        columns = np.minimum(np.arange(x0 + COARSE_PX // 2, x1 + COARSE_PX, COARSE_PX), x1 - 1)
        rows = np.minimum(np.arange(y0 + COARSE_PX // 2, y1 + COARSE_PX, COARSE_PX), y1 - 1)
        pick = np.ix_(rows, columns)
        rays = self._rays.plane[pick].astype(float)
        across, along = self._rays.by_column[pick].astype(float), self._rays.by_row[pick].astype(float)
        above = rays @ to_cells[:, :2].T + to_cells[:, 2]
        nearness = np.maximum(above[..., 2], 1e-6)
        halves: list[Picture] = []
        for axis in range(2):
            value = above[..., axis] / nearness
            slope_x = (to_cells[axis, 0] - value * to_cells[2, 0]) / nearness
            slope_y = (to_cells[axis, 1] - value * to_cells[2, 1]) / nearness
            by_column = slope_x * across[..., 0] + slope_y * across[..., 1]
            by_row = slope_x * along[..., 0] + slope_y * along[..., 1]
            half = 0.5 * np.hypot(by_column, by_row)
            size = (len(columns) * COARSE_PX, len(rows) * COARSE_PX)
            whole = cv2.resize(half.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
            halves.append(np.ascontiguousarray(whole[: y1 - y0, : x1 - x0]))
        return halves[0], halves[1]


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=float)


def _square(first: float, last: float) -> tuple[tuple[float, float], ...]:
    return (first, first), (last, first), (last, last), (first, last)


def _all_in_front(rays: Picture, to_cells: Array) -> bool:
    corners = rays[[0, 0, -1, -1], [0, -1, 0, -1]].astype(float)
    return bool((corners @ to_cells[2, :2] + to_cells[2, 2] > 1e-6).all())


def _clipped(values: Picture, low: float, high: float) -> Picture:
    return np.clip(values, np.float32(low), np.float32(high))


def _look_up(sums: Picture, u: Picture, v: Picture) -> Picture:
    import cv2

    return np.asarray(cv2.remap(sums, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32)
