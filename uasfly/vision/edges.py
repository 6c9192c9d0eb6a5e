"""Exact corners: a straight line fitted to each edge of a marker, corners where neighbouring lines meet.

Points of an edge are the centres of its grey-value step along short profiles across it, so they do not depend on blur,
which is alike on both sides. Lines are fitted in undistorted coordinates, where edges are straight, by total least
squares with Tukey's weights. All edges of all markers of a picture are treated at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.detectors import Image

_ALONG = np.linspace(0.08, 0.92, 48)  # places along an edge, away from the corners, where blur rounds it
_ACROSS = np.linspace(-1.0, 1.0, 17)  # places along a profile, in half widths
_PASSES = (1.1, 0.6, 0.5)  # half widths of the profiles, in border widths
_WIDEST_PX, _NARROWEST_PX = 6.0, 1.2
_TUKEY = 4.685
_LEAST_CONTRAST = 8.0  # grey values across an edge
_UNREFINED_SIGMA_PX = 0.7  # of a contour's corner


@dataclass(frozen=True, slots=True)
class EdgeFit:
    """Corners from fitted lines.

    Attributes:
        corners: (m, 4, 2) px, as they are in the picture; the given ones where no lines could be fitted.
        sigma_px: (m,) standard deviation of a corner, an axis.
        straightness_px: (m,) RMS distance of edge points from their lines; NaN where not fitted.
        fitted: (m,) whether the lines could be fitted.
    """

    corners: Array
    sigma_px: Array
    straightness_px: Array
    fitted: np.ndarray


def fit_edges(grey: Image, corners: Array, border: float, camera: Camera | None = None) -> EdgeFit:
    """Corners of markers from lines fitted to their edges.

    Args:
        grey: (h, w) the picture.
        corners: (m, 4, 2) px, good to a pixel or two.
        border: width of the black border as a fraction of the marker's side.
        camera: its lens is taken into account; none where not given.
    """
    start = np.asarray(corners, dtype=float).reshape(-1, 4, 2)
    rough, good = start.copy(), np.ones(len(start), dtype=bool)
    sigma, straightness = np.full(len(start), _UNREFINED_SIGMA_PX), np.full(len(start), np.nan)
    for factor in _PASSES if len(start) else ():
        points, weights = _edge_points(grey, rough, factor * border)
        flat = _undistorted(points, camera)
        lines, scatter, sharpness = _fit_lines(flat, weights)
        meeting = _meeting_points(lines)
        found = _distorted(meeting, camera)
        side = np.linalg.norm(np.roll(start, -1, axis=1) - start, axis=2)
        reach = np.maximum(3.0, 0.12 * side.mean(axis=1))
        moved = np.linalg.norm(found - start, axis=2).max(axis=1)
        good &= (moved < reach) & (sharpness > 0.5).all(axis=1)
        rough = np.where(good[:, None, None], found, rough)
        straightness = np.where(good, np.sqrt((scatter**2).mean(axis=1)), np.nan)
        independent = np.clip(0.84 * side, 4.0, len(_ALONG)) * sharpness  # neighbours closer than a pixel are one
        # Variance of a fitted line at the marker's corner: s^2/n * (1 + 3 / 0.84^2), and two lines meet there.
        at_corner = scatter * np.sqrt((1.0 + 3.0 / 0.84**2) / np.maximum(independent, 1.0))
        sigma = np.where(good, np.sqrt((at_corner**2).mean(axis=1)), _UNREFINED_SIGMA_PX)
    return EdgeFit(np.where(good[:, None, None], rough, start), sigma, straightness, good)


def _edge_points(picture: Image, corners: Array, half_width: float) -> tuple[Array, Array]:
    """Points (m, 4, n, 2) px of the edges and their weights (m, 4, n), 0 where there is no edge.

    Args:
        picture: (h, w) grey.
        corners: (m, 4, 2) px.
        half_width: of the profiles, as a fraction of the side.
    """
    along = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(along, axis=2, keepdims=True)
    outward = np.stack((along[..., 1], -along[..., 0]), axis=-1) / np.maximum(length, 1e-9)
    half = np.clip(half_width * length, _NARROWEST_PX, _WIDEST_PX)[..., None]  # (m, 4, 1, 1)
    feet = corners[:, :, None] + along[:, :, None] * _ALONG[:, None]  # (m, 4, n, 2)
    places = feet[..., None, :] + outward[:, :, None, None] * (half * _ACROSS)[..., None]
    steps = np.diff(_interpolated(picture, places), axis=-1)  # brighter outside: positive
    middle = 0.5 * (_ACROSS[1:] + _ACROSS[:-1])
    centre = np.zeros(steps.shape[:-1])
    for _ in range(4):  # the step's centre of mass under a window that follows it
        window = np.exp(-0.5 * ((middle - centre[..., None]) / 0.4) ** 2)
        mass = steps * window
        total = mass.sum(axis=-1)
        there = total > 0.3 * _LEAST_CONTRAST
        centre = np.where(there, (mass * middle).sum(axis=-1) / np.where(there, total, 1.0), 0.0)
        there &= np.abs(centre) < 0.9
        centre = np.clip(centre, -0.9, 0.9)
    contrast = np.median(np.where(there, total, 0.0), axis=(1, 2), keepdims=True)
    height, width = picture.shape
    points = feet + outward[:, :, None] * (half[..., 0] * centre)[..., None]
    inside = (points > 1.0).all(axis=-1) & (points[..., 0] < width - 2.0) & (points[..., 1] < height - 2.0)
    return points, (there & inside & (total > 0.4 * contrast)).astype(float)


def _interpolated(picture: Image, places: Array) -> Array:
    """Grey values at places (..., 2) [px], bilinear; exact, where OpenCV's remap rounds places to 1/32 px."""
    height, width = picture.shape
    x, y = np.clip(places[..., 0], 0.0, width - 1.001), np.clip(places[..., 1], 0.0, height - 1.001)
    column, row = x.astype(np.intp), y.astype(np.intp)
    x, y = x - column, y - row
    pixels, start = picture.ravel(), row * width + column
    above = pixels[start] * (1.0 - x) + pixels[start + 1] * x
    below = pixels[start + width] * (1.0 - x) + pixels[start + width + 1] * x
    return np.asarray(above * (1.0 - y) + below * y, dtype=float)


def _fit_lines(points: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Lines (m, 4, 3) (normal x, y and offset), RMS distance (m, 4) of their points and share (m, 4) of points used."""
    weights = weights * np.isfinite(points).all(axis=-1)
    points = np.nan_to_num(points)
    weight, lines = weights, np.zeros((*points.shape[:2], 3))
    scatter, used = np.zeros(points.shape[:2]), np.zeros(points.shape[:2])
    for _ in range(5):
        total = np.maximum(weight.sum(axis=-1), 1e-9)
        centre = (weight[..., None] * points).sum(axis=2) / total[..., None]
        offset = points - centre[:, :, None]
        xx, yy, xy = (
            (weight * offset[..., i] * offset[..., j]).sum(axis=-1) / total for i, j in ((0, 0), (1, 1), (0, 1))
        )
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        normal = np.stack((-np.sin(angle), np.cos(angle)), axis=-1)
        distance = (offset * normal[:, :, None]).sum(axis=-1)
        lines = np.concatenate((normal, -(normal * centre).sum(axis=-1, keepdims=True)), axis=-1)
        scatter = np.sqrt((weight * distance**2).sum(axis=-1) / total)
        used = (weight > 0.1).mean(axis=-1)
        masked = np.where(weights > 0.0, np.abs(distance), np.nan)
        with np.errstate(all="ignore"):
            spread = np.maximum(1.4826 * _nanmedian(masked), 0.02)[..., None]
        weight = weights * np.clip(1.0 - (distance / (_TUKEY * spread)) ** 2, 0.0, 1.0) ** 2
    return lines, scatter, used


def _nanmedian(values: Array) -> Array:
    """Median along the last axis of what is not NaN; 0 where nothing is."""
    count = np.isfinite(values).sum(axis=-1)
    ordered = np.sort(values, axis=-1)  # NaN last
    place = np.maximum(count // 2, 0)[..., None] % values.shape[-1]
    middle = np.take_along_axis(ordered, place, axis=-1)[..., 0]
    return np.asarray(np.where(count > 0, np.nan_to_num(middle), 0.0), dtype=float)


def _meeting_points(lines: Array) -> Array:
    """Points (m, 4, 2): corner i is where edge i-1 meets edge i; NaN where they are parallel."""
    before = np.roll(lines, 1, axis=1)
    cross = before[..., 0] * lines[..., 1] - before[..., 1] * lines[..., 0]
    x = before[..., 1] * lines[..., 2] - before[..., 2] * lines[..., 1]
    y = before[..., 2] * lines[..., 0] - before[..., 0] * lines[..., 2]
    with np.errstate(all="ignore"):
        meeting = np.where(np.abs(cross) > 0.05, np.stack((x, y)) / cross, np.nan)
    return np.asarray(meeting.transpose(1, 2, 0), dtype=float)


def _undistorted(points: Array, camera: Camera | None) -> Array:
    if camera is None or camera.keeps_lines:
        return points
    plane = camera.normalise(points.reshape(-1, 2)).reshape(points.shape)
    return np.asarray(plane * (camera.fx, camera.fy) + (camera.cx, camera.cy), dtype=float)


def _distorted(points: Array, camera: Camera | None) -> Array:
    if camera is None or camera.keeps_lines:
        return points
    plane = (points.reshape(-1, 2) - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return camera.project(np.column_stack((plane, np.ones(len(plane))))).reshape(points.shape)
