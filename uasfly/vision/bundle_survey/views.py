"""The pictures that a survey looks at: what is seen in each, and a choice of them that is spread."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from uasfly.camera import Camera
from uasfly.errors import FileError
from uasfly.messages import Array
from uasfly.vision.consistency import implausible
from uasfly.vision.detectors import Detection, Detector
from uasfly.vision.pictures import pictures, step_of
from uasfly.vision.seek import detect_markers
from uasfly.vision.square import square_poses

_NEW_MARKER = 0.25  # how much a marker more or less tells views apart, as a shift by this share of the picture
_SAME = 0.015  # views that differ by less, as a share of the picture's diagonal, are one


@dataclass(frozen=True, slots=True)
class View:
    """One picture.

    Attributes:
        name: for people.
        seen: whole, plausible markers by id.
    """

    name: str
    seen: dict[int, Detection]


def look(
    sources: Iterable[str], detector: Detector, camera: Camera, sizes: dict[int, float], size_m: float, step: int | None
) -> Iterator[tuple[str, View | None]]:
    """Name of each picture that is looked at and its view; None where fewer than two markers are seen.

    Args:
        sources: pictures, folders, videos.
        detector: of the markers' family.
        camera: the lens.
        sizes: sides [m] by id, where they differ from `size_m`.
        size_m: side of the others.
        step: one frame of a video in so many; see `step_of`.

    Raises:
        FileError: a source cannot be read, or a picture is not of the camera's size.
    """
    for source in sources:
        every = step_of(source, step)
        for number, (name, image) in enumerate(pictures(source)):
            if number % every:
                continue
            expected, found = (camera.width_px, camera.height_px), (image.shape[1], image.shape[0])
            if found != expected:
                size = f"{expected[0]} x {expected[1]} px (camera {camera.name}), found {found[0]} x {found[1]}"
                raise FileError(name, [f"expected {size}; give the camera file of this size"])
            yield name, _view(name, detect_markers(image, detector, camera), camera, sizes, size_m)


def _view(
    name: str, detections: list[Detection], camera: Camera, sizes: dict[int, float], size_m: float
) -> View | None:
    counts = Counter(detection.marker_id for detection in detections)
    focal, seen = 0.5 * (camera.fx + camera.fy), {}
    for detection in detections:
        if counts[detection.marker_id] > 1:  # nothing says which is meant
            continue
        plane = camera.normalise(detection.corners)
        poses = square_poses(plane, sizes.get(detection.marker_id, size_m)) if np.isfinite(plane).all() else []
        if poses and not implausible(detection, focal * poses[0][1]):
            seen[detection.marker_id] = detection
    return View(name, seen) if len(seen) > 1 else None


def spread(views: list[View], camera: Camera, most: int) -> list[View]:
    """Up to `most` views that differ from each other, those that differ most first chosen; in their old order.

    Each next one is the view farthest from all chosen ones (Gonzalez 1985): by how far its markers have moved in the
    picture, and by which markers it sees.
    """
    if not views:
        return []
    diagonal = float(np.hypot(camera.width_px, camera.height_px))
    chosen = [max(range(len(views)), key=lambda index: len(views[index].seen))]
    nearest = _distances(views, chosen[0], diagonal)
    while len(chosen) < min(most, len(views)) and nearest.max() > _SAME:
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, _distances(views, chosen[-1], diagonal))
    return [views[index] for index in sorted(chosen)]


def _distances(views: list[View], index: int, diagonal: float) -> Array:
    return np.array([0.0 if at == index else _distance(view, views[index], diagonal) for at, view in enumerate(views)])


def _distance(one: View, other: View, diagonal: float) -> float:
    common = one.seen.keys() & other.seen.keys()
    different = len(one.seen.keys() ^ other.seen.keys())
    shift = 0.0
    if common:
        moves = [one.seen[marker].corners - other.seen[marker].corners for marker in common]
        shift = float(np.linalg.norm(moves, axis=2).mean()) / diagonal
    return shift + _NEW_MARKER * different / len(one.seen.keys() | other.seen.keys())
