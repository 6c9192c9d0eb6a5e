from __future__ import annotations

import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.sim_camera import views
from uasfly.frames import rotation_matrix
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import MarkerSample
from uasfly.sim.camera.process import CameraProcess
from uasfly.sim.camera.settings import Background, Noise
from uasfly.vision.bundle_worker import watch_bundles

PATIENCE_S = 60.0


def test_a_simulated_cameras_stream_becomes_marker_samples() -> None:
    """From the true pose over rendering, JPEG, HTTP, detection and pose to a sample of the right time and place."""
    camera = views.camera(exposure_s=0.004, latency_s=0.05)
    settings = views.clean(rate_hz=20.0, lens_blur_px=0.5, noise=Noise(), background=Background(kind="clutter"))
    body = [-1.0, 0.2, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    with CameraProcess(camera, views.four(), settings, seed=1) as process:
        stop = threading.Event()

        def fly() -> None:
            start_s, step = time.monotonic(), 0
            while not stop.wait(0.004):
                step += 1
                process.feed.watch(0.004 * step, body, None)
                process.feed.send(start_s + 0.004 * step)

        flight = threading.Thread(target=fly, daemon=True)
        flight.start()
        worker = watch_bundles(camera, (views.four(),), process.url)
        samples: list[MarkerSample] = []
        deadline = time.monotonic() + PATIENCE_S
        while len(samples) < 4:
            assert time.monotonic() < deadline, worker.take_announcements()
            for seen in worker.take():
                (look,) = seen.result
                assert look.sample is not None
                assert look.sample.time_s == seen.exposed_s
                assert seen.arrived_s - seen.exposed_s >= 0.05
                samples.append(look.sample)
            time.sleep(0.01)
            if samples:
                last = samples[-1]
                expected = MarkerPrediction(last.position_in_body, last.quaternion_marker_to_body)
                worker.predict({last.marker_id: expected})
        worker.close()
        stop.set()
        flight.join()
    for sample in samples:
        assert sample.position_in_body == pytest.approx([3.0, -0.2, -0.1], abs=0.02)
        assert rotation_matrix(sample.quaternion_marker_to_body)[:, 2] == pytest.approx([-1.0, 0.0, 0.0], abs=0.03)


def test_pictures_of_another_size_are_named(tmp_path: Path) -> None:
    """A calibration of 640 x 480 is of no use for other pictures: the pilot is told so."""
    cv2.imwrite(str(tmp_path / "1.png"), np.zeros((100, 200), dtype=np.uint8))
    worker = watch_bundles(views.camera(), (views.four(),), str(tmp_path), rate_hz=50.0, loop=True)
    said: list[str] = []
    deadline = time.monotonic() + PATIENCE_S
    while not any("found 200 x 100" in text for text in said):
        assert time.monotonic() < deadline, said
        said += [text for _, text in worker.take_announcements()]
        time.sleep(0.01)
    worker.close()


def test_a_source_that_is_none_is_announced() -> None:
    """Its name is wrong: nothing is raised in the cycle, the pilot is told what was expected."""
    worker = watch_bundles(views.camera(), (views.four(),), "no/such/camera")
    said: list[str] = []
    deadline = time.monotonic() + PATIENCE_S
    while not any("found no such thing" in text for text in said):
        assert time.monotonic() < deadline, said
        said += [text for _, text in worker.take_announcements()]
        time.sleep(0.01)
    worker.close()
