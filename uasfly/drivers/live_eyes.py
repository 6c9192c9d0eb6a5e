"""The camera of a live flight: detection in a process of its own, and what the cycle has to do with it.

No call waits. A camera or a detection that is dead or hangs is announced and started again; the flight goes on.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

from uasfly.drivers.sight import Sight
from uasfly.messages import MarkerSample
from uasfly.observer.observer import Observer
from uasfly.vision.bundle_worker import Predictions, watch_bundles
from uasfly.vision.frames import Announcement
from uasfly.vision.tracker import Look
from uasfly.vision.worker import DetectionWorker

EXPECT_EVERY_S = 0.03  # about as often as frames come


class LiveEyes:
    """Sightings from a detection worker.

    Args:
        worker: looks at the camera's frames.
        numbers: of the bundles that it looks for.
    """

    def __init__(self, worker: DetectionWorker[Predictions, tuple[Look, ...]], numbers: tuple[int, ...]) -> None:
        self._worker = worker
        self._numbers = numbers
        self._expected_s = -math.inf

    def look(self) -> tuple[MarkerSample, ...]:
        """Sightings since the last call, oldest first."""
        looks = (look for seen in self._worker.take() for look in seen.result)
        return tuple(look.sample for look in looks if look.sample is not None)

    def take_announcements(self) -> list[Announcement]:
        """What the pilot should know of camera and detection since the last call."""
        return self._worker.take_announcements()

    def expect(self, now_s: float, observer: Observer) -> None:
        """Tell the detection where the filter expects the bundles, now and then."""
        if now_s - self._expected_s < EXPECT_EVERY_S:
            return
        self._expected_s = now_s
        expected = ((number, observer.expected(now_s, number)) for number in self._numbers)
        self._worker.predict({number: marker for number, marker in expected if marker is not None})

    def close(self) -> None:
        """End the detection, within a second whatever hangs."""
        self._worker.close()


@contextlib.contextmanager
def open_eyes(sight: Sight | None, simulated_url: str) -> Iterator[LiveEyes | None]:
    """The eyes of a live flight while it lasts; None without a camera.

    Args:
        sight: camera and bundles.
        simulated_url: stream of the simulated camera, "" where there is none.
    """
    target = "" if sight is None else sight.source or simulated_url
    if sight is None or not target:
        yield None
        return
    eyes = LiveEyes(
        watch_bundles(sight.camera, sight.bundles, target), tuple(bundle.marker_id for bundle in sight.bundles)
    )
    try:
        yield eyes
    finally:
        eyes.close()
