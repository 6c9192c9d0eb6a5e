"""How much detection at full load disturbs a control cycle: `python -m tests.vision_sources.disturbance`.

A loop at 50 Hz does what a cycle does (a few milliseconds of arithmetic, half of it Python's) and notes when each cycle
is done, counted from when it was due. It runs alone, beside the worker's process, and beside a detector in a thread of
the same process, in turns, so that what else the machine does falls on all three alike.
"""

from __future__ import annotations

import contextlib
import functools
import sys
import threading
import time
from collections.abc import Iterator

import cv2
import numpy as np

from tests.sim_camera import views
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import Background, Noise
from uasfly.vision.bundle_pose import solve_bundle
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.frames import Announcement, Frame
from uasfly.vision.seek import detect_markers
from uasfly.vision.worker import DetectionWorker
from uasfly.vision.worker_process import Job

RATE_HZ, TURN_S = 50.0, 5.0


class Rendered:
    """A camera that always has a frame: the detector never waits."""

    def __init__(self) -> None:
        settings = views.clean(
            lens_blur_px=0.5, noise=Noise(), vignetting=0.3, background=Background(kind="clutter"), exposure_s=0.004
        )
        renderer = Renderer(big_camera(), views.four(), settings, np.random.default_rng(1))
        self.ended = False
        self._images = [renderer.render(views.view((0.1 * i, 0.0, 0.0), (0.0, 0.02 * i, 0.1))) for i in range(5)]
        self._count = 0

    def take(self) -> Frame:
        """The next one."""
        self._count += 1
        now_s = time.monotonic()
        return Frame(now_s, now_s, self._count - 1, self._images[self._count % len(self._images)])

    def take_announcements(self) -> list[Announcement]:
        """Nothing."""
        return []

    def close(self) -> None:
        """Nothing."""


def big_camera() -> Camera:
    """A camera of 1280 x 720."""
    return views.camera(width_px=1280, height_px=720, fx=914.0, fy=914.0, cx=639.5, cy=359.5)


class Looker:
    """The real detector and pose solver."""

    def __init__(self, camera: Camera, bundle: Bundle) -> None:
        self._camera, self._bundle = camera, bundle
        self._detector = make_detector(bundle.family)

    def __call__(self, frame: Frame, prediction: object) -> int:
        """How many markers were used."""
        detections = detect_markers(frame.image, self._detector, self._camera)
        return len(solve_bundle(self._bundle, self._camera, detections).used)


def make_looker() -> Looker:
    """For the worker's process."""
    return Looker(big_camera(), views.four())


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Nothing beside the loop."""
    yield


@contextlib.contextmanager
def in_a_process() -> Iterator[None]:
    """Detection in the worker's process."""
    worker: DetectionWorker[object, int] = DetectionWorker(Job(Rendered, make_looker))
    while not worker.take():
        time.sleep(0.05)
    count, start_s = worker.counts.frames, time.monotonic()
    yield
    rate = (worker.counts.frames - count) / (time.monotonic() - start_s)
    print(f"    {rate:.1f} frames a second in the process")
    worker.close()


@contextlib.contextmanager
def in_a_thread() -> Iterator[None]:
    """Detection in a thread of this process."""
    source, looker, stop = Rendered(), make_looker(), threading.Event()
    count = [0]

    def work() -> None:
        while not stop.is_set():
            looker(source.take(), None)
            count[0] += 1

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    start_s = time.monotonic()
    yield
    print(f"    {count[0] / (time.monotonic() - start_s):.1f} frames a second in the thread")
    stop.set()
    thread.join()


def cycle(matrix: np.ndarray) -> None:
    """A few milliseconds of work."""
    for _ in range(60):
        matrix @ matrix
    sum(i * i for i in range(15_000))


def loop(seconds: float) -> list[float]:
    """Times [ms] from when each cycle was due to when it was done."""
    matrix = np.random.default_rng(0).standard_normal((60, 60))
    done: list[float] = []
    due_s = time.perf_counter()
    for _ in range(int(seconds * RATE_HZ)):
        due_s += 1.0 / RATE_HZ
        time.sleep(max(0.0, due_s - time.perf_counter()))
        cycle(matrix)
        done.append((time.perf_counter() - due_s) * 1e3)
        due_s = max(due_s, time.perf_counter() - 1.0 / RATE_HZ)
    return done


def main(turns: int = 6) -> None:
    """Measure and print."""
    cv2.setNumThreads(1)
    times: dict[str, list[float]] = {"alone": [], "process": [], "thread": []}
    ways = {"alone": alone, "process": in_a_process, "thread": in_a_thread}
    for _ in range(turns):
        for name, way in ways.items():
            with way():
                times[name] += loop(TURN_S)
    each = {name: np.percentile(np.reshape(values, (turns, -1)), 99, axis=1) for name, values in times.items()}
    for name, values in times.items():
        median, p99 = np.percentile(values, (50, 99))
        ratio = float(np.median(each[name] / each["alone"]))  # of turns next to each other: stalls do not count
        print(f"{name:8} median {median:6.2f} ms  p99 {p99:6.2f} ms  p99 against alone {ratio:.2f} (median of {turns})")


if __name__ == "__main__":
    functools.partial(main, *(int(argument) for argument in sys.argv[1:2]))()
