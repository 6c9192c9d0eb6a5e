"""Bundles followed in the frames of a camera, in a process beside the control cycle."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.marker_prediction import MarkerPrediction
from uasfly.vision.frames import Frame
from uasfly.vision.sources import open_source
from uasfly.vision.tracker import BundleTracker, Look
from uasfly.vision.worker import DetectionWorker
from uasfly.vision.worker_process import Job

Predictions = Mapping[int, MarkerPrediction]  # by the bundle's number
Looking = Callable[[Frame, Predictions | None], tuple[Look, ...]]


def watch_bundles(
    camera: Camera, bundles: tuple[Bundle, ...], target: str, rate_hz: float | None = None, loop: bool = False
) -> DetectionWorker[Predictions, tuple[Look, ...]]:
    """Follow bundles in the frames that a camera source gives; a frame gives a look for each, in their order.

    Args:
        camera: lens, mounting, and the latency of frames that carry no time stamp.
        bundles: the markers.
        target: what `open_source` opens; a source that is none is announced, not raised.
        rate_hz: pictures a second from a file or folder.
        loop: begin a folder again after its last picture.
    """
    opener = functools.partial(open_source, target, camera.latency_s, rate_hz, loop)
    job: Job[Predictions, tuple[Look, ...]] = Job(opener, functools.partial(_make_looking, camera, bundles))
    return DetectionWorker(job)


def _make_looking(camera: Camera, bundles: tuple[Bundle, ...]) -> Looking:
    trackers = [(bundle.marker_id, BundleTracker(camera, bundle)) for bundle in bundles]

    def look(frame: Frame, predictions: Predictions | None) -> tuple[Look, ...]:
        height, width = frame.image.shape
        if (width, height) != (camera.width_px, camera.height_px):
            raise UasflyError(
                f"expected pictures of {camera.width_px} x {camera.height_px} as the camera file {camera.name} says, "
                f"found {width} x {height}; set the camera's resolution, or calibrate for this one"
            )
        expected = predictions or {}
        return tuple(tracker.look(frame.image, frame.exposed_s, expected.get(number)) for number, tracker in trackers)

    return look
