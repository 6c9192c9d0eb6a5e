"""Marker detection: its own times, and a camera's worth of it beside a flight."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from uasfly.bench.timing import Figures, as_in_flight
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.files import find_file, load_file
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.marker_prediction import MarkerPrediction
from uasfly.sim.camera.motion import camera_motion
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings
from uasfly.vision.bundle_worker import watch_bundles
from uasfly.vision.frames import Image
from uasfly.vision.tracker import BundleTracker

CAMERA, BUNDLE = "vga", "floor_36h11"
PICTURES = 12
HEIGHT_M, SWAY_M, SWAY_RAD = 3.0, 0.15, 0.05  # as over the bundle in a gust
SIGMA_M = 0.05  # of the prediction: what a hover knows after a sighting
WARM_UP = 12
START_TIMEOUT_S = 30.0


@dataclass(frozen=True, slots=True)
class DetectionFigures:
    """Times of one picture of 640 x 480 with a bundle of four markers, corners and pose included [ms].

    Attributes:
        whole: the whole picture is searched.
        region: only where the filter expects the bundle.
    """

    whole: Figures
    region: Figures

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Plain data."""
        return {"whole": self.whole.as_dict(), "region": self.region.as_dict()}


class DetectionBench:
    """Rendered pictures of a bundle, for the detector that flies.

    Args:
        seed: of the poses and the noise in the pictures.
    """

    def __init__(self, seed: int) -> None:
        self._camera = load_file(find_file("camera", CAMERA), Camera)
        self._bundle = load_file(find_file("bundle", BUNDLE), Bundle)
        self._pictures = _render(self._camera, self._bundle, np.random.default_rng(seed))

    def measure(self, rounds: int) -> DetectionFigures:
        """Look at all pictures so many times.

        Raises:
            UasflyError: the bundle is not found: the times would be of something else.
        """
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)  # as in the detector's own process
        try:
            whole, region = self._look(rounds)
        finally:
            cv2.setNumThreads(threads)
        return DetectionFigures(whole, region)

    def _look(self, rounds: int) -> tuple[Figures, Figures]:
        searching, following = (BundleTracker(self._camera, self._bundle) for _ in range(2))
        whole_ms: list[float] = []
        region_ms: list[float] = []
        with as_in_flight():
            for number in range(WARM_UP + rounds * PICTURES):
                image = self._pictures[number % PICTURES]
                started = time.perf_counter()
                look = searching.look(image, 0.0)
                between = time.perf_counter()
                if look.sample is None:
                    raise UasflyError(f"marker detection: the bundle {BUNDLE} was not found in a rendered picture")
                expected = MarkerPrediction(
                    look.sample.position_in_body, look.sample.quaternion_marker_to_body, SIGMA_M
                )
                resumed = time.perf_counter()
                followed = following.look(image, 0.0, expected)
                ended = time.perf_counter()
                if number >= WARM_UP:
                    whole_ms.append(1e3 * (between - started))
                    if followed.region is not None:
                        region_ms.append(1e3 * (ended - resumed))
        whole, region = Figures.of(whole_ms), Figures.of(region_ms)
        if whole is None or region is None:
            raise UasflyError("marker detection: too few pictures were looked at")
        return whole, region

    @contextmanager
    def running(self, figures: DetectionFigures) -> Iterator[None]:
        """Detection in its process beside whatever runs here, at full load: the next picture always waits.

        Raises:
            UasflyError: it does not start.
        """
        with TemporaryDirectory(prefix="uasfly-bench-") as folder:
            for number, image in enumerate(self._pictures):
                cv2.imwrite(str(Path(folder) / f"{number:02d}.png"), image)
            rate_hz = 2e3 / figures.whole.median
            worker = watch_bundles(self._camera, (self._bundle,), folder, rate_hz, loop=True)
            try:
                deadline_s = time.monotonic() + START_TIMEOUT_S
                while not worker.take():
                    if time.monotonic() > deadline_s:
                        raise UasflyError("marker detection: its process does not start")
                    time.sleep(0.05)
                yield
            finally:
                worker.close()


def _render(camera: Camera, bundle: Bundle, rng: np.random.Generator) -> list[Image]:
    settings = CameraSettings(bundle=BundlePlacement(position_m=(0.0, 0.0, 0.0)))
    renderer = Renderer(camera, bundle, settings, rng)
    mounting = camera.transform_camera_to_body
    pictures = []
    for _ in range(PICTURES):
        place, tilt = rng.normal(0.0, SWAY_M, 3), rng.normal(0.0, SWAY_RAD, 3)
        body = rotation_matrix(quaternion_from_euler(*tilt.tolist()))
        motion = camera_motion(
            np.array((0.0, 0.0, HEIGHT_M)) + place,
            np.zeros(3),
            body,
            np.zeros(3),
            mounting.position,
            mounting.rotation,
            np.zeros(3),
        )
        pictures.append(renderer.render(motion))
    return pictures
