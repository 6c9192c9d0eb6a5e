"""Draws what was found into a picture: corners, ids, axes of the bundle, and markers that were left out."""

from __future__ import annotations

import numpy as np

from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.bundle_pose import BundleSight
from uasfly.vision.detectors import Detection, Image

_GREEN, _RED, _YELLOW = (60, 200, 60), (50, 50, 230), (40, 200, 240)
_AXES = ((50, 50, 230), (60, 200, 60), (230, 120, 40))  # x red, y green, z blue, as blue-green-red
_SHIFT = 4  # binary digits of a pixel's fraction
_AXIS_M = 0.1


def annotated(image: Image, found: list[Detection], sight: BundleSight | None, camera: Camera | None) -> Image:
    """A copy (h, w, 3) of a picture with what was found.

    Args:
        image: (h, w) grey or (h, w, 3) blue-green-red.
        found: markers: green where used or no bundle was asked for, red with the reason where left out.
        sight: the bundle's; its axes are drawn 10 cm long: x red, y green, z blue.
        camera: the lens.
    """
    import cv2

    drawn = np.ascontiguousarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy())
    size = max(0.4, drawn.shape[1] / 1600.0)
    reasons = {} if sight is None else {id(entry.corners): entry.reason for entry in sight.left_out}
    for detection in found:
        reason = reasons.get(id(detection.corners), "")
        colour = _RED if reason else _GREEN
        cv2.polylines(drawn, [_fixed(detection.corners)], True, colour, 1, cv2.LINE_AA, _SHIFT)
        cv2.circle(drawn, _point(detection.corners[0]), round(3 * 2**_SHIFT), _YELLOW, 1, cv2.LINE_AA, _SHIFT)
        label = f"{detection.marker_id} {reason}".strip()
        x, y = (int(value) for value in detection.corners.min(axis=0) - (0, 4))
        cv2.putText(drawn, label, (x, y), cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1, cv2.LINE_AA)
    if sight is not None and sight.pose is not None and camera is not None:
        ends = camera.project(sight.pose.points(np.vstack((np.zeros(3), _AXIS_M * np.eye(3)))))
        if np.isfinite(ends).all() and np.abs(ends).max() < 1e4:
            for axis, colour in enumerate(_AXES):
                cv2.line(drawn, _point(ends[0]), _point(ends[axis + 1]), colour, 2, cv2.LINE_AA, _SHIFT)
    return np.asarray(drawn, dtype=np.uint8)


def _fixed(points: Array) -> np.ndarray:
    return np.asarray(np.round(np.clip(points, -1e5, 1e5) * 2**_SHIFT), dtype=np.int32).reshape(-1, 1, 2)


def _point(point: Array) -> tuple[int, int]:
    x, y = _fixed(point).ravel().tolist()
    return x, y
