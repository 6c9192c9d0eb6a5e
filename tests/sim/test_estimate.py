from __future__ import annotations

import math
from array import array

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler, quaternion_inverse, quaternion_product, rotation_vector_from_quaternion
from uasfly.messages import Array, OdometrySample
from uasfly.sim.estimate import Estimate
from uasfly.sim.scenario import Delays, Gnss, Sensors

STEP = 0.004
ATTITUDE = quaternion_from_euler(0.1, -0.2, 0.8)
QUIET = Sensors(
    position="mocap",
    position_noise_m=0.0,
    velocity_noise_m_s=0.0,
    velocity_wander_m_s=0.0,
    attitude_noise_rad=0.0,
    attitude_wander_rad=0.0,
    angular_rate_noise_rad_s=0.0,
)


def state_at(time_s: float) -> array[float]:
    """A vehicle that flies east with 2 m/s and climbs with 1 m/s, in a constant attitude."""
    return array("d", (2.0 * time_s, 0.0, time_s, 2.0, 0.0, 1.0, *ATTITUDE, 0.1, 0.2, 0.3))


def watched(sensors: Sensors, seconds: float, seed: int = 1) -> tuple[list[OdometrySample], Array]:
    """Odometry of every step and the true positions."""
    state = state_at(0.0)
    estimate = Estimate(sensors, np.random.default_rng(seed), state, STEP)
    samples, truth = [], []
    for step in range(round(seconds / STEP)):
        state[:] = state_at(step * STEP)
        if step:
            estimate.advance()
        samples.append(estimate.odometry(step * STEP))
        truth.append(state[0:3].tolist())
    return samples, np.array(truth)


def test_without_errors_the_estimate_is_the_truth() -> None:
    """All sigmas zero: position, velocity, attitude and rate are the plant's."""
    samples, truth = watched(QUIET, 0.5)
    last = samples[-1]
    assert last.position_in_world == pytest.approx(truth[-1])
    assert last.velocity_in_world == pytest.approx([2.0, 0.0, 1.0])
    assert last.quaternion_body_to_world == pytest.approx(ATTITUDE)
    assert last.angular_rate_in_body == pytest.approx([0.1, 0.2, 0.3])
    assert last.time_s == pytest.approx(0.496)


def test_noise_has_the_sigmas_of_the_scenario() -> None:
    """White noise of position, velocity, attitude and rate has its sigma, and no memory from sample to sample."""
    sensors = QUIET.model_copy(
        update={
            "position_noise_m": 0.01,
            "position_rate_hz": 250.0,
            "velocity_noise_m_s": 0.02,
            "attitude_noise_rad": 0.002,
            "angular_rate_noise_rad_s": 0.006,
        }
    )
    samples, truth = watched(sensors, 20.0)
    inverse = quaternion_inverse(ATTITUDE)
    for errors, sigma in (
        (np.array([s.position_in_world for s in samples]) - truth, 0.01),
        (np.array([s.velocity_in_world for s in samples]) - (2.0, 0.0, 1.0), 0.02),
        (
            np.array(
                [
                    rotation_vector_from_quaternion(quaternion_product(inverse, s.quaternion_body_to_world))
                    for s in samples
                ]
            ),
            0.002,
        ),
        (np.array([s.angular_rate_in_body for s in samples]) - (0.1, 0.2, 0.3), 0.006),
    ):
        assert errors.std(axis=0) == pytest.approx(np.full(3, sigma), rel=0.05)
        assert np.abs(errors.mean(axis=0)).max() < 4.0 * sigma / math.sqrt(len(errors))
        assert abs(np.corrcoef(errors[1:, 0], errors[:-1, 0])[0, 1]) < 0.05


def test_a_position_is_held_until_the_next_one() -> None:
    """The position's error changes position_rate_hz times a second."""
    samples, truth = watched(QUIET.model_copy(update={"position_noise_m": 0.01, "position_rate_hz": 50.0}), 2.0)
    errors = (np.array([s.position_in_world for s in samples]) - truth)[:, 0]
    changes = np.flatnonzero(np.abs(np.diff(errors)) > 1e-9)
    assert np.all(np.diff(changes) == 5)


def test_wander_is_a_gauss_markov_process() -> None:
    """The slow error keeps its sigma and forgets itself with the scenario's time constant."""
    sensors = QUIET.model_copy(update={"velocity_wander_m_s": 0.03, "attitude_wander_rad": 0.002, "wander_time_s": 0.5})
    samples, _ = watched(sensors, 60.0)
    errors = np.array([s.velocity_in_world for s in samples])[::10] - (2.0, 0.0, 1.0)
    assert errors.std(axis=0) == pytest.approx(np.full(3, 0.03), rel=0.25)
    correlation = np.mean([np.corrcoef(errors[12:, axis], errors[:-12, axis])[0, 1] for axis in range(3)])
    assert correlation == pytest.approx(math.exp(-12 * 10 * STEP / 0.5), abs=0.12)


def test_gnss_walks_as_the_paper_says() -> None:
    """Over many seeds the bias after T seconds has sigma q sqrt(T) (eq. 11), starting from the initial bias."""
    gnss = Gnss(white_sigma_m=0.0, random_walk_m_sqrt_s=0.2, initial_bias_m=(1.0, 0.0, 0.0))
    sensors = Sensors.model_validate(
        {**QUIET.model_dump(), "position": "gnss", "position_noise_m": None, "gnss": gnss, "position_rate_hz": 10.0}
    )
    errors = []
    for seed in range(60):
        state = state_at(0.0)
        estimate = Estimate(sensors, np.random.default_rng(seed), state, STEP)
        for _ in range(round(2.0 / STEP)):
            estimate.advance()
        errors.append(estimate.odometry(0.0).position_in_world)
    spread = np.array(errors) - (1.0, 0.0, 0.0)
    assert np.sqrt((spread**2).mean()) == pytest.approx(0.2 * math.sqrt(2.0), rel=0.2)


def test_gnss_is_sound_until_it_walks() -> None:
    """With `walk_from_s` the bias stays as it begins until the vehicle has been in offboard for so long."""
    gnss = Gnss(white_sigma_m=0.0, random_walk_m_sqrt_s=0.2, initial_bias_m=(1.0, 0.0, 0.0), walk_from_s=1.0)
    sensors = Sensors.model_validate(
        {**QUIET.model_dump(), "position": "gnss", "position_noise_m": None, "gnss": gnss, "position_rate_hz": 10.0}
    )
    estimate = Estimate(sensors, np.random.default_rng(1), state_at(0.0), STEP)
    biases = []
    for step in range(round(3.0 / STEP)):
        biases.append(estimate.position_bias)
        estimate.engaged_for_s = step * STEP - 1.0 if step * STEP >= 1.0 else None
        estimate.advance()
    last_sound = round(2.0 / STEP)
    assert set(biases[:last_sound]) == {(1.0, 0.0, 0.0)}
    assert len(set(biases[last_sound:])) >= 10


def test_delays_age_the_samples() -> None:
    """With a position delay of 40 ms the sample tells where the vehicle was 40 ms before."""
    sensors = QUIET.model_copy(update={"delays": Delays(position_s=0.04)})
    samples, truth = watched(sensors, 1.0)
    assert samples[-1].position_in_world == pytest.approx(truth[-1 - 10])
    assert samples[-1].velocity_in_world == pytest.approx([2.0, 0.0, 1.0])


def test_reading_twice_gives_the_same() -> None:
    """Reading draws nothing: the estimate of a step is what it is."""
    estimate = Estimate(Sensors(position="mocap", position_noise_m=0.01), np.random.default_rng(1), state_at(0.0), STEP)
    first, second = estimate.odometry(0.0), estimate.odometry(0.0)
    assert first.position_in_world.tolist() == second.position_in_world.tolist()
    assert first.quaternion_body_to_world.tolist() == second.quaternion_body_to_world.tolist()


def test_losing_gnss_runs_away_is_told_and_jumps_back() -> None:
    """Without positions the estimate drifts, turns invalid after 5 s, jumps back, and is trusted 6.4 s later."""
    state = state_at(0.0)
    estimate = Estimate(QUIET, np.random.default_rng(4), state, STEP)

    def wait(seconds: float) -> OdometrySample:
        for _ in range(round(seconds / STEP)):
            estimate.advance()
        return estimate.odometry(0.0)

    assert not estimate.position_ok
    wait(2.5)
    assert estimate.position_ok
    assert estimate.horizontal_accuracy_m == pytest.approx(0.3)
    estimate.set_gnss(False)
    wait(4.9)
    assert estimate.position_ok
    drifted = wait(7.0)
    assert not estimate.position_ok
    assert estimate.attitude_ok
    assert estimate.horizontal_accuracy_m > 5.0
    error = math.hypot(*(drifted.position_in_world[:2]))
    assert 0.3 < error < 10.0
    assert drifted.position_in_world[2] == 0.0
    estimate.set_gnss(True)
    back = wait(0.1)
    assert back.reset_counter == drifted.reset_counter + 1
    assert math.hypot(*(back.position_in_world[:2])) < 1e-9
    assert not estimate.position_ok
    wait(5.2)
    assert not estimate.position_ok
    wait(0.4)
    assert estimate.position_ok
    assert not estimate.position_trusted
    wait(0.8)
    assert estimate.position_trusted


def test_an_offset_moves_the_positions() -> None:
    """A faulty source shifts what it gives, with the next position."""
    estimate = Estimate(QUIET, np.random.default_rng(4), state_at(0.0), STEP)
    estimate.gnss_offset = (8.0, 0.0, 0.0)
    for _ in range(10):
        estimate.advance()
    assert estimate.odometry(0.0).position_in_world == pytest.approx([8.0, 0.0, 0.0])
