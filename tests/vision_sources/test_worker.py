from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest

from tests.vision_sources import workers
from uasfly.vision.frames import Announcement
from uasfly.vision.worker import DetectionWorker
from uasfly.vision.worker_process import Job

PATIENCE_S = 60.0


class Watched:
    """A worker, and all that it has said and seen."""

    def __init__(self, source: Callable[[], Any], looker: Callable[[], Any], hung_s: float = 3.0) -> None:
        self.worker: DetectionWorker[Any, Any] = DetectionWorker(Job(source, looker), hung_s)
        self.said: list[Announcement] = []
        self.seen: list[Any] = []

    def until(self, condition: Callable[[], bool]) -> None:
        """Poll as a control cycle does until a condition holds."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, self.said
            self.said += self.worker.take_announcements()
            self.seen += self.worker.take()
            time.sleep(0.005)

    def told(self, words: str) -> Callable[[], bool]:
        """Whether something has been said."""
        return lambda: any(words in text for _, text in self.said)


@pytest.fixture
def watch(request: pytest.FixtureRequest) -> Callable[..., Watched]:
    """Starts workers and closes them."""

    def start(*arguments: Any) -> Watched:
        watched = Watched(*arguments)

        def close() -> None:
            start_s = time.monotonic()
            watched.worker.close()
            assert time.monotonic() - start_s < 1.0

        request.addfinalizer(close)
        return watched

    return start


def test_results_come_with_their_times_and_the_newest_prediction(watch: Callable[..., Watched]) -> None:
    """Frames are looked at one after the other, elsewhere; what is predicted meanwhile is used."""
    watched = watch(workers.Numbers, workers.make_read_number)
    watched.until(lambda: len(watched.seen) >= 3)
    watched.worker.predict("there")
    watched.until(lambda: watched.seen[-1].result[1] == "there")
    first = watched.seen[0]
    assert first.result == (1, None)
    assert first.arrived_s - first.exposed_s == pytest.approx(0.02)
    assert first.took_s >= 0.01
    assert [seen.sequence for seen in watched.seen] == list(range(len(watched.seen)))
    assert watched.told("hello")()
    assert watched.worker.counts.pid != os.getpid()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system has no such thing")
def test_detection_leaves_half_of_the_cores_to_the_flight(watch: Callable[..., Watched]) -> None:
    """It keeps to the upper half of them; of one core it takes that one."""
    watched = watch(workers.Numbers, workers.make_read_number)
    watched.until(lambda: bool(watched.seen))
    cores = sorted(os.sched_getaffinity(0))
    assert os.sched_getaffinity(watched.worker.counts.pid) == set(cores[len(cores) // 2 :])


def test_a_killed_process_is_started_again(watch: Callable[..., Watched]) -> None:
    """Its death is announced, and that it works again."""
    watched = watch(workers.Numbers, workers.make_read_number)
    watched.until(lambda: bool(watched.seen))
    os.kill(watched.worker.counts.pid, signal.SIGKILL)
    watched.until(watched.told("has died; starting it again"))
    watched.until(watched.told("works again"))
    assert watched.worker.counts.starts == 2


def test_a_process_that_hangs_is_killed_and_started_again(watch: Callable[..., Watched]) -> None:
    """Silence is noticed; closing takes no second although the process is stopped."""
    watched = watch(workers.Numbers, workers.make_hang, 0.6)
    watched.until(watched.told("hangs (silent for 0.6 s)"))
    first = watched.worker.counts.pid
    watched.until(lambda: watched.worker.counts.starts >= 2)
    assert watched.worker.counts.pid != first
    with pytest.raises(ProcessLookupError):
        os.kill(first, 0)


def test_a_camera_without_frames_is_no_hang(watch: Callable[..., Watched]) -> None:
    """The process says that it lives while it waits."""
    watched = watch(workers.Still, workers.make_read_number, 1.5)
    watched.until(watched.told("hello"))
    time.sleep(2.0)
    assert watched.worker.counts.starts == 1


def test_a_picture_that_the_detector_cannot_cope_with_is_left_out(watch: Callable[..., Watched]) -> None:
    """It is announced once, and the next pictures are looked at."""
    watched = watch(workers.Numbers, workers.make_fail)
    watched.until(lambda: len(watched.seen) >= 4)
    assert [seen.sequence for seen in watched.seen[:4]] == [1, 2, 4, 5]
    assert len([text for _, text in watched.said if "odd picture" in text]) == 1


def test_a_detector_that_cannot_be_made_is_named(watch: Callable[..., Watched]) -> None:
    """The reason reaches the pilot."""
    watched = watch(workers.Numbers, workers.make_nothing)
    watched.until(watched.told("no detector of this name"))


def test_what_cannot_be_pickled_is_named(watch: Callable[..., Watched]) -> None:
    """A job that does not get into another process is announced, not raised in the cycle."""
    watched = watch(lambda: None, workers.make_read_number)
    watched.until(watched.told("does not start"))
