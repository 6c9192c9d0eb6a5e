"""The simulated camera's own process: reads its job, then exposures; renders each, and shows it when it arrives."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
import time
from collections import deque

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.sim.camera.feed import read_exposure
from uasfly.sim.camera.mjpeg import MjpegServer
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings
from uasfly.sim.camera.shutter import Exposure

NICENESS = 5  # a camera costs its vehicle's computer nothing
_LONGEST_LINE = 1 << 24


class NewestExposures:
    """Exposures that are to be rendered; where rendering is too slow the older ones are left out."""

    def __init__(self) -> None:
        self._under_way: deque[Exposure] = deque()
        self._changed = threading.Condition()
        self._ended = False

    def put(self, exposure: Exposure) -> None:
        """One more."""
        with self._changed:
            self._under_way.append(exposure)
            self._changed.notify()

    def end(self) -> None:
        """There will be no more."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def next(self) -> Exposure | None:
        """Wait for the next one that is worth rendering; None at the end."""
        with self._changed:
            while not self._under_way and not self._ended:
                self._changed.wait()
            if self._ended:
                return None
            late_s = time.monotonic()
            exposure = self._under_way.popleft()
            while self._under_way and self._under_way[0].arrives_s < late_s:
                exposure = self._under_way.popleft()
            return exposure


def main() -> None:
    """Serve the camera that a line of JSON on standard input describes (see `process`)."""
    import cv2

    cv2.setNumThreads(1)
    with contextlib.suppress(OSError):
        os.nice(NICENESS)
    source = sys.stdin.buffer
    job = json.loads(source.readline(_LONGEST_LINE))
    try:
        settings = CameraSettings.model_validate_json(job["settings"])
        renderer = Renderer(
            Camera.model_validate_json(job["camera"]),
            Bundle.model_validate_json(job["bundle"]),
            settings,
            np.random.default_rng([job["seed"], 12]),
            [
                (Bundle.model_validate_json(one), BundlePlacement.model_validate_json(place))
                for one, place in job["others"]
            ],
        )
        server = MjpegServer(job["port"])
    except UasflyError as error:
        print("failed", str(error).replace("\n", "; "), flush=True)
        sys.exit(2)
    print("ready", server.port, flush=True)
    exposures = NewestExposures()
    threading.Thread(target=_read, args=(exposures,), daemon=True).start()
    while (exposure := exposures.next()) is not None:
        if not server.watched:
            continue
        image = renderer.render(exposure.motion, exposure.since_s)
        time.sleep(max(0.0, exposure.arrives_s - time.monotonic()))
        server.publish(image, exposure.exposed_s)
    os._exit(0)  # clients that hang are no reason to stay


def _read(exposures: NewestExposures) -> None:
    for line in sys.stdin.buffer:
        with contextlib.suppress(ValueError):  # a full pipe cuts lines
            exposures.put(read_exposure(line))
    exposures.end()
