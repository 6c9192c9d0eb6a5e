from __future__ import annotations

import math
from collections.abc import Mapping

import cv2
import numpy as np
import pytest

from tests.sim_camera import views
from uasfly.files import find_file, load_file
from uasfly.frames import quaternion_from_rotation_vector, rotation_matrix
from uasfly.messages import Array, FlightMode
from uasfly.sim.camera.mount import Mount
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import MountMotion
from uasfly.sim.camera.shutter import Arrivals, Exposure, Shutter
from uasfly.sim.camera.timing import FrameClock
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

STEP_S = 0.004


def state_at(time_s: float) -> list[float]:
    """True state of a body that circles and turns about a slanted axis, faster and faster."""
    position = (2.0 * math.cos(time_s), 2.0 * math.sin(time_s), 1.0)
    velocity = (-2.0 * math.sin(time_s), 2.0 * math.cos(time_s), 0.0)
    axis = np.array((0.6, 0.0, 0.8))
    quaternion = quaternion_from_rotation_vector(axis * (0.5 * time_s + 0.5 * time_s**2))
    return [*position, *velocity, *quaternion, *(axis * (0.5 + time_s))]


def exposures(settings_changes: Mapping[str, object], seconds: float = 2.0, seed: int = 3) -> list[Exposure]:
    """What a shutter takes on that body."""
    shutter = Shutter(views.camera(exposure_s=0.01), views.clean(**settings_changes), np.random.default_rng(seed))
    for step in range(1, int(seconds / STEP_S) + 1):
        shutter.watch(step * STEP_S, state_at(step * STEP_S), None)
    return shutter.take()


def angle_between(left: Array, right: Array) -> float:
    """Angle [rad] between two rotations."""
    return float(np.arccos(np.clip(0.5 * (np.trace(left.T @ right) - 1.0), -1.0, 1.0)))


def test_exposures_carry_the_true_pose_at_their_own_time() -> None:
    """Between two steps of the simulation the pose is that of the exposure's middle, not of a step."""
    taken = exposures({"rate_hz": 31.0})
    assert len(taken) == pytest.approx(62, abs=1)
    for exposure in taken[1:]:
        state = state_at(exposure.exposed_s)
        assert exposure.body_position == pytest.approx(state[0:3], abs=1e-6)
        assert angle_between(exposure.body_to_world, rotation_matrix(np.array(state[6:10]))) < 1e-6
        lens = np.array(state[0:3]) + rotation_matrix(np.array(state[6:10])) @ (0.1, 0.0, 0.0)
        assert exposure.motion.position_in_world == pytest.approx(lens, abs=1e-6)


def test_the_camera_is_mounted_with_the_errors_of_the_scenario() -> None:
    """The true camera differs from its file by the scenario's rotation and offset."""
    right, wrong = (
        exposures({}),
        exposures({"mounting_error_deg": (0.0, 1.0, 0.0), "mounting_error_m": (0.0, 0.01, 0.0)}),
    )
    first, second = right[5], wrong[5]
    turn = angle_between(first.motion.rotation_camera_to_world, second.motion.rotation_camera_to_world)
    assert math.degrees(turn) == pytest.approx(1.0, abs=1e-3)
    apart = first.body_to_world.T @ (second.motion.position_in_world - first.motion.position_in_world)
    assert apart == pytest.approx([0.0, 0.01, 0.0], abs=1e-9)


def test_frames_come_late_unevenly_and_not_all() -> None:
    """Latency, jitter and losses are those of the scenario, and the order of the frames stays."""
    changes = {"rate_hz": 100.0, "latency_s": 0.05, "jitter_s": 0.04, "drop_share": 0.3}
    taken = exposures(changes, seconds=20.0)
    delays = np.array([exposure.arrives_s - exposure.exposed_s for exposure in taken])
    assert delays.min() >= 0.05
    assert delays.max() <= 0.09 + 1e-9
    assert delays.mean() == pytest.approx(0.072, abs=0.005)
    assert len(taken) / 2000 == pytest.approx(0.7, abs=0.04)
    assert np.all(np.diff([exposure.arrives_s for exposure in taken]) >= 0.0)
    assert [it.exposed_s for it in exposures(changes, 1.0)] == [it.exposed_s for it in exposures(changes, 1.0)]
    assert [it.exposed_s for it in exposures(changes, 1.0)] != [it.exposed_s for it in exposures(changes, 1.0, seed=4)]


def test_a_silent_camera_gives_nothing() -> None:
    """While the silence lasts there is no frame, before and after there are."""
    times = [it.exposed_s for it in exposures({"silences": [{"start_s": 0.5, "end_s": 1.5}]})]
    assert not [time_s for time_s in times if 0.504 <= time_s < 1.496]
    assert min(times) < 0.1
    assert max(times) > 1.9


def test_the_schedule_waits_for_offboard() -> None:
    """By default scheduled times count from the first offboard, and go on after it."""
    shutter = Shutter(views.camera(), views.clean(after="offboard"), np.random.default_rng(1))
    for step in range(1, 1001):
        time_s = step * STEP_S
        shutter.watch(time_s, state_at(time_s), time_s - 2.0 if 2.0 <= time_s < 3.0 else None)
    for exposure in shutter.take():
        if exposure.exposed_s < 1.99:
            assert exposure.since_s == -math.inf
        elif exposure.exposed_s > 2.01:
            assert exposure.since_s == pytest.approx(exposure.exposed_s - 2.0, abs=0.005)


def test_the_mount_sways_and_vibrates_as_told() -> None:
    """Standard deviation and correlation time of the sway, amplitude and rate of the vibration."""
    sway = Mount(MountMotion(sway_deg=1.0, sway_time_s=0.5), np.random.default_rng(1))
    angles = np.degrees([sway.at(0.1 * step, 0.005)[0] for step in range(20_000)])
    assert angles.std(axis=0) == pytest.approx([1.0] * 3, rel=0.1)
    together = np.mean(angles[5:] * angles[:-5]) / np.mean(angles**2)
    assert together == pytest.approx(math.exp(-1.0), abs=0.06)
    shaken = Mount(MountMotion(vibration_deg=0.1, vibration_hz=50.0), np.random.default_rng(1))
    moved = [shaken.at(0.0003 * step, 1e-4) for step in range(4000)]
    assert np.degrees([turn for turn, _ in moved]).std(axis=0) == pytest.approx([0.1] * 3, rel=0.02)
    rates = np.degrees([rate for _, rate in moved]).std(axis=0)
    assert rates == pytest.approx([0.1 * 2.0 * math.pi * 50.0] * 3, rel=0.02)


def test_the_clock_shoots_evenly() -> None:
    """Shots follow each other by the period, from a random phase on."""
    clock = FrameClock(views.clean(rate_hz=25.0), 0.0, np.random.default_rng(1))
    times = [clock.shoot(0.0).exposed_s for _ in range(100)]
    assert np.diff(times) == pytest.approx([0.04] * 99)
    assert 0.0 < times[0] < 0.04


def test_a_camera_on_a_vehicle_changes_nothing_of_its_flight() -> None:
    """The same seed flies the same flight with and without a camera; the camera's frames show the bundle below."""
    plant = load_file(find_file("plant", "f550"), Plant)
    down = {"position_m": (0.0, 0.0, 0.0), "rpy_deg": (180.0, 0.0, -90.0)}
    settings = views.clean(bundle={"on": "floor", "position_m": (0.0, 0.0, 0.0)}, rate_hz=10.0)
    scenario = Scenario(name="test", camera=settings)
    camera = views.camera(transform_camera_to_body=down, latency_s=0.1)
    shutter = Shutter(camera, settings, np.random.default_rng(5))
    ends = []
    for watcher in (None, shutter.watch):
        vehicle = SimulatedVehicle(plant, scenario, seed=1)
        vehicle.watcher = watcher
        vehicle.advance_to(4.0)
        vehicle.arm()
        vehicle.set_takeoff_height(2.0)
        vehicle.set_mode(FlightMode.TAKEOFF)
        vehicle.advance_to(11.0)
        ends.append(vehicle.truth().position_in_world)
    without, with_camera = ends
    assert np.array_equal(without, with_camera)
    arrivals = Arrivals(shutter)
    frames = arrivals.until(11.0)
    assert len(frames) == pytest.approx(109, abs=1)
    assert all(frame.arrives_s <= 11.0 for frame in frames)
    assert not arrivals.until(11.0)
    renderer = Renderer(camera, views.single(), settings, np.random.default_rng(6))
    assert ends[0][2] > 1.0
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    corners, ids, _ = detector.detectMarkers(renderer.render(frames[-1].motion, frames[-1].since_s))
    assert np.ravel(ids).tolist() == [5]
    sides = np.linalg.norm(np.diff(corners[0][0], axis=0), axis=1)
    assert sides.mean() == pytest.approx(0.2 * 552.0 / ends[0][2], rel=0.1)
