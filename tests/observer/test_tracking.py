"""How the filter follows: force steps, rates, correlated errors, GNSS bias and markers."""

from __future__ import annotations

import numpy as np
import pytest

from tests.observer.airframes import f550
from tests.observer.recorded import MARKER, flying_observer, recording
from tests.observer.test_observer import LEVEL, estimated, in_air, setpoint
from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.frames import quaternion_from_rotation_vector
from uasfly.messages import Array, OdometrySample
from uasfly.observer import Observer
from uasfly.observer import states as s

STEP_S, STEP_M_S2 = 4.0, 1.5


def force_step(airframe: Airframe, rate_hz: float, seed: int) -> tuple[Array, Array]:
    """Times and estimated force (n, 3) when a blower along x comes on at STEP_S (a level f550 is blown away)."""
    noise, rng, dt = airframe.observer, np.random.default_rng(seed), 1.0 / rate_hz
    observer = Observer(airframe)
    observer.add(in_air(-1.0))
    observer.sent(setpoint(-1.0, GRAVITY_M_S2 / airframe.model.k_thrust_m_s2), in_offboard=True)
    drag = airframe.model.drag_1_s[0]
    times = np.arange(0.0, 6.0, dt)
    forces = []
    for time_s in times:
        since = max(time_s - STEP_S, 0.0)
        speed = STEP_M_S2 / drag * (1.0 - np.exp(-drag * since))
        way = STEP_M_S2 / drag * since - speed / drag
        observer.add(
            OdometrySample(
                time_s,
                np.array((way, 0.0, 0.0)) + noise.position_sigma_m * rng.standard_normal(3),
                np.array((speed, 0.0, 0.0)) + noise.velocity_sigma_m_s * rng.standard_normal(3),
                quaternion_from_rotation_vector(noise.attitude_sigma_rad * rng.standard_normal(3)),
                np.zeros(3),
            )
        )
        forces.append(estimated(observer, time_s).force_in_world)
    return times, np.array(forces)


@pytest.mark.parametrize(("rate_hz", "slowest_s"), [(100.0, 0.26), (50.0, 0.3)])
def test_a_force_step_is_known_within_a_quarter_of_a_second(rate_hz: float, slowest_s: float) -> None:
    """1.5 m/s^2 with the recommended densities: 63 % in 0.15 to 0.3 s, at most 15 % too far, quiet before."""
    airframe = f550(force_density=0.5, acceleration_density=0.05)
    runs = [force_step(airframe, rate_hz, seed) for seed in range(4)]
    times, mean = runs[0][0], np.mean([force[:, 0] for _, force in runs], axis=0)
    reached_s = times[(times > STEP_S) & (mean > 0.632 * STEP_M_S2)][0] - STEP_S
    assert 0.15 < reached_s < slowest_s
    assert mean[times > STEP_S].max() < 1.15 * STEP_M_S2
    assert mean[times > STEP_S + 1.0].mean() == pytest.approx(STEP_M_S2, abs=0.05)
    quiet = (times > 2.0) & (times < STEP_S)
    assert np.mean([force[quiet].std(axis=0) for _, force in runs]) < 0.12


def steady_sigmas(airframe: Airframe, rate_hz: float) -> Array:
    """Sigmas (21,) after three seconds of hovering with samples at a rate."""
    observer = Observer(airframe)
    observer.add(in_air(-1.0))
    for k in range(round(3.0 * rate_hz)):
        observer.add(OdometrySample(k / rate_hz, np.zeros(3), np.zeros(3), LEVEL, np.zeros(3)))
    return np.sqrt(np.diag(observer.covariance))


def test_with_correlated_errors_a_higher_rate_does_not_make_the_filter_surer() -> None:
    """Correlation of 50 ms: from 50 to 200 Hz the sigmas stay within 5 %; taken as white they fall by over 20 %."""
    fixed = {"matching_window_s": 1e9, "gnss_bias_density": 1e-6}
    correlated = f550(position_correlation_s=0.05, velocity_correlation_s=0.05, attitude_correlation_s=0.05, **fixed)
    slow, fast = steady_sigmas(correlated, 50.0), steady_sigmas(correlated, 200.0)
    core = slice(0, s.D_FORCE.stop)
    np.testing.assert_allclose(fast[core], slow[core], rtol=0.05)
    slow, fast = steady_sigmas(f550(**fixed), 50.0), steady_sigmas(f550(**fixed), 200.0)
    assert np.all(fast[s.D_VELOCITY] < 0.8 * slow[s.D_VELOCITY])


def test_with_errors_of_the_configured_correlation_the_filter_knows_how_wrong_it_is() -> None:
    """Position and velocity errors correlated over 0.1 s: NEES of the two near 6, far above it where taken as white."""
    rng, dt, correlation_s = np.random.default_rng(1), 0.01, 0.1
    rho = np.exp(-dt / correlation_s)
    means = []
    for configured_s in (correlation_s, 0.0):
        airframe = f550(
            position_correlation_s=configured_s,
            velocity_correlation_s=configured_s,
            gnss_bias_density=1e-6,
            matching_window_s=1e9,
            force_density=0.05,
        )
        noise, values = airframe.observer, []
        for _ in range(8):
            observer = Observer(airframe)
            observer.add(in_air(-1.0))
            error = rng.standard_normal(6)
            for k in range(300):
                error = rho * error + np.sqrt(1.0 - rho**2) * rng.standard_normal(6)
                position, velocity = noise.position_sigma_m * error[:3], noise.velocity_sigma_m_s * error[3:]
                observer.add(OdometrySample(k * dt, position, velocity, LEVEL, np.zeros(3)))
                if k > 100 and k % 10 == 0:
                    assert observer.moment is not None
                    wrong = observer.moment.packed[:6]
                    values.append(wrong @ np.linalg.solve(observer.covariance[:6, :6], wrong))
        means.append(np.mean(values))
    assert means[0] < 7.5
    assert means[1] > 12.0


def fly_by_marker(sighted_s: tuple[float, float], drift_m_s: float) -> tuple[Array, Array, Array]:
    """Fly with GNSS drifting east from 1 s on, marker seen in a span; errors, biases and drifts, one row a sample."""
    flight, observer = recording(), flying_observer(gnss_bias_density=0.03)
    sightings = iter([x for x in flight.sightings if sighted_s[0] < x.time_s < sighted_s[1]])
    seen = next(sightings, None)
    errors, biases, drifts = [], [], []
    for k, sample in enumerate(flight.odometry):
        drift = np.array((drift_m_s * max(sample.time_s - 1.0, 0.0), 0.0, 0.0))
        while seen is not None and seen.time_s <= sample.time_s:
            observer.add(seen)
            seen = next(sightings, None)
        gnss = sample.position_in_world + drift
        observer.add(
            OdometrySample(
                sample.time_s,
                gnss,
                sample.velocity_in_world,
                sample.quaternion_body_to_world,
                sample.angular_rate_in_body,
            )
        )
        estimate = estimated(observer, sample.time_s)
        errors.append(estimate.position_in_world - flight.position[k])
        biases.append(estimate.gnss_bias_in_world)
        drifts.append(drift + flight.bias[k])
    return np.array(errors), np.array(biases), np.array(drifts)


def test_without_a_marker_the_bias_is_held_and_the_position_follows_gnss() -> None:
    """The bias does not move at all, however far GNSS drifts."""
    errors, biases, drifts = fly_by_marker((99.0, 99.0), drift_m_s=0.1)
    assert np.all(biases == 0.0)
    assert np.abs(errors[100:] - drifts[100:]).max() < 0.04


def test_a_marker_frees_the_bias_and_the_position_stays_with_the_marker() -> None:
    """GNSS drifts by 0.7 m while the marker is seen: the bias takes it, the position is right to some centimetres."""
    errors, biases, drifts = fly_by_marker((0.9, 99.0), drift_m_s=0.1)
    assert np.abs(errors[200:]).max() < 0.05
    assert np.abs(biases[200:] - drifts[200:]).max() < 0.05


def test_nothing_steps_when_the_bias_is_freed_or_held_again() -> None:
    """Marker seen from 3 s to 5 s in a drift of 0.1 m/s: no jump of the estimate at either end."""
    errors, _, _ = fly_by_marker((3.0, 5.0), drift_m_s=0.1)
    steps = np.abs(np.diff(errors, axis=0))
    ordinary = steps[100:290].max()  # what the noise of GNSS does while the bias is held
    assert steps[290:].max() < 1.5 * ordinary < 0.02
    before, at_marker, after = errors[295, 0], errors[500, 0], errors[-1, 0]
    assert at_marker == pytest.approx(before, abs=0.04)  # the position stays where the marker was first seen
    assert after == pytest.approx(at_marker, abs=0.06)  # and goes on by its velocity for a while


def test_a_marker_is_found_where_it_is() -> None:
    """Its pose and sigma after some seconds of sightings."""
    flight, observer = recording(), flying_observer(gnss_bias_density=1e-3)
    for sample in flight.in_order():
        observer.add(sample)
    moment = observer.moment
    assert moment is not None
    pose = moment.packed[s.marker_nominal(0)]
    np.testing.assert_allclose(pose[:3], MARKER[:3], atol=0.02)
    assert abs(abs(pose[3:] @ MARKER[3:]) - 1.0) < 1e-4
    assert observer.counters.rejected["marker"] <= 3
