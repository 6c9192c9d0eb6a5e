from __future__ import annotations

import math

import numpy as np
import pytest

from tests.sim_camera import views
from uasfly.camera import Camera
from uasfly.frames import quaternion_inverse, quaternion_product, rotation_matrix, rotation_vector_from_quaternion
from uasfly.messages import Array, MarkerSample
from uasfly.sim.camera.motion import camera_motion
from uasfly.sim.camera.noise_model import NoiseModelCamera
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import Background, Noise
from uasfly.sim.camera.shutter import Arrivals, Exposure, Shutter
from uasfly.vision.bundle_pose import solve_bundle
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.mounting import marker_sample
from uasfly.vision.pose import Pose
from uasfly.vision.seek import detect_markers
from uasfly.vision.square import quaternion_of

REAL = {
    "lens_blur_px": 0.5,
    "noise": Noise(),
    "vignetting": 0.3,
    "background": Background(kind="concrete"),
    "exposure_s": 0.006,
}


def exposure(camera: Camera, position: Array, velocity: Array, yaw_rad: float, since_s: float = 0.0) -> Exposure:
    """A body at a place, turned about the vertical."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    to_world = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    placement = camera.transform_camera_to_body
    motion = camera_motion(
        position, velocity, to_world, np.zeros(3), placement.position, placement.rotation, np.zeros(3)
    )
    return Exposure(0, 0.0, 0.0, since_s, motion, position, to_world)


def error_of(sample: MarkerSample, shot: Exposure, bundle_position: Array, bundle_to_world: Array) -> Array:
    """Error (6,) of a pose: position [m, body], rotation [rad, marker axes: true = measured * exp(error)]."""
    true_position = shot.body_to_world.T @ (bundle_position - shot.body_position)
    true = quaternion_of(shot.body_to_world.T @ bundle_to_world)
    turn = quaternion_product(quaternion_inverse(sample.quaternion_marker_to_body), true)
    return np.concatenate((true_position - sample.position_in_body, rotation_vector_from_quaternion(turn)))


@pytest.mark.parametrize(
    ("distance", "aside", "speed"),
    [(1.8, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 1.8, 0.0), (4.5, 0.5, 0.0), (3.0, 0.0, 2.5)],
)
def test_errors_are_those_of_the_detector_on_rendered_frames(distance: float, aside: float, speed: float) -> None:
    """At several distances and angles, sharp and blurred, the model's errors are within a factor of 2 of the real ones.

    The factor is what a mean of the squares of a few dozen errors and the detector's own outliers leave.
    """
    camera, bundle, settings = views.camera(), views.four(), views.clean(**REAL)
    renderer = Renderer(camera, bundle, settings, np.random.default_rng(1))
    model = NoiseModelCamera(camera, bundle, settings, np.random.default_rng(2))
    detector = make_detector("36h11")
    rng = np.random.default_rng(3)
    real, modelled = [], []
    for _ in range(25):
        position = np.array((2.0 - distance, aside, 0.0)) + 0.05 * rng.standard_normal(3)
        direction = rng.standard_normal(3)
        velocity = speed * direction / np.linalg.norm(direction)
        shot = exposure(camera, position, velocity, -math.atan2(aside, distance) + 0.03 * rng.standard_normal())
        place, to_world = renderer.placed.pose(0.0)
        to_camera = shot.motion.rotation_camera_to_world.T
        true = Pose(to_camera @ (place - shot.motion.position_in_world), quaternion_of(to_camera @ to_world))
        detections = detect_markers(renderer.render(shot.motion), detector, camera)
        sight = solve_bundle(bundle, camera, detections, true)
        if sight.pose is not None and sight.covariance is not None:
            sample = marker_sample(camera, 0, 0.0, sight.pose, sight.covariance)
            real.append(error_of(sample, shot, place, to_world))
        for _ in range(4):
            drawn = model.see(shot)
            if drawn is not None:
                modelled.append(error_of(drawn, shot, place, to_world))
    assert len(real) == pytest.approx(25, abs=3)
    assert len(modelled) / 4 == pytest.approx(len(real), abs=3)
    for part in (slice(0, 3), slice(3, 6)):
        ratio = np.sqrt(np.mean(np.array(modelled)[:, part] ** 2) / np.mean(np.array(real)[:, part] ** 2))
        assert 0.5 < ratio < 2.0


def test_errors_have_the_covariance_that_the_sample_states() -> None:
    """Where the camera file's smallest pixel error does not hide it, the stated covariance is that of the errors."""
    camera = views.camera(pixel_sigma=1e-4)
    model = NoiseModelCamera(camera, views.four(), views.clean(**REAL), np.random.default_rng(1))
    shot = exposure(camera, np.array((-1.0, 0.8, 0.2)), np.zeros(3), -0.2)
    place, to_world = np.array((2.0, 0.0, 0.0)), model._placed.first_rotation
    samples = [model.see(shot) for _ in range(600)]
    nees = []
    for sample in samples:
        assert sample is not None
        error = error_of(sample, shot, place, to_world)
        nees.append(error @ np.linalg.solve(sample.covariance, error))
    assert np.mean(nees) == pytest.approx(6.0, abs=3.0 * math.sqrt(12.0 / 600))


def test_the_mountings_uncertainty_is_stated() -> None:
    """The covariance has the camera file's mounting in it; an error of the mounting shows in the pose."""
    loose = views.camera(mounting_sigma_deg=1.0, mounting_sigma_m=0.02)
    model = NoiseModelCamera(loose, views.four(), views.clean(**REAL), np.random.default_rng(1))
    sample = model.see(exposure(loose, np.array((-1.0, 0.0, 0.0)), np.zeros(3), 0.0))
    assert sample is not None
    assert math.sqrt(sample.covariance[1, 1]) == pytest.approx(math.hypot(0.02, 2.9 * math.radians(1.0)), rel=0.05)


def test_what_cannot_be_seen_gives_no_sample() -> None:
    """Too far, from behind, out of the picture, blurred away, or hidden."""
    camera = views.camera()
    hidden = views.clean(**REAL, occlusions=[{"start_s": 1.0, "end_s": 2.0, "share": 1.0}])
    model = NoiseModelCamera(camera, views.four(), hidden, np.random.default_rng(1))
    still = np.zeros(3)
    near = np.array((-0.5, 0.0, 0.0))
    assert model.see(exposure(camera, near, still, 0.0)) is not None
    assert model.see(exposure(camera, near, still, 0.0, since_s=1.5)) is None
    assert model.see(exposure(camera, near, still, math.pi)) is None
    assert model.see(exposure(camera, np.array((4.5, 0.0, 0.0)), still, math.pi)) is None
    assert model.see(exposure(camera, np.array((-18.0, 0.0, 0.0)), still, 0.0)) is None
    assert model.see(exposure(camera, near, np.array((0.0, 30.0, 0.0)), 0.0)) is None


def test_samples_arrive_late() -> None:
    """They come when their frames would, and are of the time of the exposure."""
    camera = views.camera(latency_s=0.1)
    settings = views.clean(rate_hz=20.0)
    shutter = Shutter(camera, settings, np.random.default_rng(1))
    model = NoiseModelCamera(camera, views.four(), settings, np.random.default_rng(2))
    body = [-0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    for step in range(1, 251):
        shutter.watch(0.004 * step, body, None)
    arrived = Arrivals(shutter).until(1.0)
    assert len(arrived) == pytest.approx(18, abs=1)
    samples = [model.see(exposure) for exposure in arrived]
    for seen, sample in zip(arrived, samples, strict=True):
        assert sample is not None
        assert sample.time_s == seen.exposed_s
        assert seen.arrives_s - seen.exposed_s == pytest.approx(0.1)
    assert samples[0] is not None
    assert rotation_matrix(samples[0].quaternion_marker_to_body)[:, 2] == pytest.approx([-1, 0, 0], abs=0.1)
