"""Which markers do not belong: unknown, torn, moved, of the wrong size, or with another's number."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from uasfly.bundle import Bundle, BundleMarker
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.detectors import Detection
from uasfly.vision.pose import Pose

Reason = Literal["not in the bundle", "torn", "moved", "wrong size", "wrong id", "seen twice", "contradicts"]

_TOLERANCE_PX = 1.2  # of a marker's corners, RMS: print, mounting and lens are never perfect
_TOLERANCE_SIDE = 0.02  # the same as a fraction of its side in the picture
_TOLERANCE_SIGMAS = 5.0
_LEAST_SIDE_PX = 5.0
_WRONG_SIZE = 0.05
_TURNED_RAD = math.radians(4.0)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A marker that takes no part in a pose, and why.

    Attributes:
        marker_id: as decoded.
        corners: (4, 2) px.
        reason: in a word or two.
        text: with numbers.
    """

    marker_id: int
    corners: Array
    reason: Reason
    text: str


def side_px(corners: Array) -> float:
    """Mean side [px] of corners (4, 2)."""
    return float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).mean())


def tolerance_px(detection: Detection) -> float:
    """How far, RMS, a marker's corners may lie from where the bundle's pose puts them."""
    side = side_px(detection.corners)
    return max(_TOLERANCE_PX, _TOLERANCE_SIDE * side, _TOLERANCE_SIGMAS * detection.sigma_px)


def implausible(detection: Detection, square_residual_px: float | None) -> str:
    """Why four corners cannot be those of a whole flat marker; "" where they can.

    Args:
        detection: the marker.
        square_residual_px: RMS distance of its corners from those of the best square; None where there is none.
    """
    corners = detection.corners
    if not np.isfinite(corners).all():
        return "its corners are not numbers"
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    side = side_px(corners)
    if (turns <= 0.0).any():
        return "its corners do not run clockwise round a convex shape"
    if np.linalg.norm(edges, axis=1).min() < _LEAST_SIDE_PX:
        return f"a side is shorter than {_LEAST_SIDE_PX:g} px"
    if detection.straightness_px > max(0.8, 0.03 * side):
        return f"its edges are not straight ({detection.straightness_px:.1f} px)"
    if square_residual_px is None:
        return "no square looks like this"
    if square_residual_px > max(2.0, 0.04 * side, _TOLERANCE_SIGMAS * detection.sigma_px):
        return f"its corners are {square_residual_px:.1f} px off those of a square"
    return ""


def explain(bundle: Bundle, camera: Camera, pose: Pose, marker: BundleMarker, detection: Detection) -> LeftOut:
    """Why a marker does not fit the bundle's pose, by comparing its four corners with where they should be.

    Args:
        bundle: which bundle.
        camera: the lens.
        pose: of the bundle in camera axes.
        marker: what the bundle says of the marker.
        detection: where it is.
    """
    expected = camera.project(pose.points(marker.corners))
    found = detection.corners
    side = side_px(expected)
    shift = found.mean(axis=0) - expected.mean(axis=0)
    a, b = expected - expected.mean(axis=0), found - found.mean(axis=0)
    dot, cross = float((a * b).sum()), float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    growth, turn = math.hypot(dot, cross) / float((a * a).sum()), math.atan2(cross, dot)
    shift_m = float(np.linalg.norm(shift)) / side * marker.size_m
    tolerance = tolerance_px(detection)

    def left_out(reason: Reason, text: str) -> LeftOut:
        return LeftOut(detection.marker_id, found, reason, text)

    if not np.isfinite(expected).all():
        return left_out("moved", "its place in the bundle is out of sight")
    if float(np.linalg.norm(shift)) > max(2.0 * tolerance, 0.3 * side):
        for other in bundle.markers:
            place = camera.project(pose.points(other.corners))
            if other.id != marker.id and float(np.abs(place - found).max()) < max(3.0 * tolerance, 0.1 * side):
                return left_out("wrong id", f"it is where marker {other.id} belongs")
    if float(np.linalg.norm(shift)) > 2.0 * tolerance + abs(growth - 1.0) * side * 0.25:
        return left_out("moved", f"it is {shift_m * 100.0:.1f} cm from its place in the bundle")
    if abs(growth - 1.0) > max(_WRONG_SIZE, tolerance / side):
        size = growth * marker.size_m
        return left_out(
            "wrong size", f"it looks {size * 100.0:.1f} cm large, the file says {marker.size_m * 100.0:.1f}"
        )
    if abs(turn) > _TURNED_RAD:
        return left_out("moved", f"it is turned by {math.degrees(turn):.0f} degrees")
    rest = float(np.sqrt(((found - expected - shift) ** 2).sum(axis=1).mean()))
    if rest > tolerance:
        return left_out("torn", f"its corners are {rest:.1f} px off the shape that it should have")
    return left_out("moved", f"it is {shift_m * 100.0:.1f} cm from its place in the bundle")
