"""The accelerometer in the filter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2

from tests.observer.airframes import f550
from tests.observer.manifold import difference_quotient, evaluated, flying_inputs, plus_core, random_core
from tests.observer.test_functions import covariance_of, packed_state
from tests.observer.truth import conjugates, flights, fly_commands, nees, rotated
from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import rotation_matrix
from uasfly.messages import AccelerometerSample, Array, FlightMode, OdometrySample, Setpoint, VehicleSample
from uasfly.observer import Observer, functions
from uasfly.observer import measurements as me
from uasfly.observer import states as s
from uasfly.observer.step import VERTICAL_VARIANCE

RUNS, DT_S, SIGMA = 30, 0.01, 0.15
LEVEL, REST = np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3)
PUSH = np.array((1.2, -0.7, 0.1))
FELT = np.array((1.2, -0.7, 0.1 + GRAVITY_M_S2 - 0.1))
HOVER = GRAVITY_M_S2 / 28.54209


def reading(core: Array, thrust: float, drag: Array) -> Array:
    """Specific force (3,) of eq. 1, written out."""
    by_air = core[s.FORCE] - drag * core[s.VELOCITY]
    return rotation_matrix(core[s.QUATERNION]).T @ by_air + (0.0, 0.0, thrust)


@pytest.mark.parametrize("seed", range(3))
def test_the_reading_and_its_jacobian_are_those_of_the_model(seed: int) -> None:
    """All forces but gravity, in the body; H agrees with finite differences, and thrust is in the third row alone."""
    rng = np.random.default_rng(seed)
    core, thrust, drag = random_core(rng), np.array((9.3,)), np.array((0.26, 0.2, 0.1))
    expected = evaluated(me.measure_specific_force, core, thrust, drag)[0]
    np.testing.assert_allclose(expected, reading(core, 9.3, drag), atol=1e-12)
    np.testing.assert_allclose(
        evaluated(me.specific_force_jacobian, core, thrust, drag)[0],
        difference_quotient(lambda error: reading(plus_core(core, error), 9.3, drag), s.CORE_ERROR),
        atol=1e-8,
    )


@pytest.mark.parametrize("markers", [0, 1])
@pytest.mark.parametrize("off", [0.05, 3.0])
def test_an_accelerometer_step_is_the_textbook_update(markers: int, off: float) -> None:
    """Gain, Joseph form, reset written out; attitude, bias and wanders held; outside the gate only the prediction."""
    rng = np.random.default_rng(5)
    layout, packed = s.Layout(markers), packed_state(markers, rng)
    inputs = np.zeros(s.ACCELEROMETER_INPUTS)
    inputs[: s.PREDICTION_INPUTS] = flying_inputs(rng, 0.01)
    predicted = np.empty(packed.size)
    functions.Caller(functions.prediction(markers))((packed, inputs), (predicted,))
    core, thrust, drag = predicted[: s.CORE_NOMINAL], inputs[[s.IN_THRUST]], inputs[s.IN_DRAG]
    residual = np.array((off, -off, 0.3))
    R = np.diag((SIGMA**2, SIGMA**2, VERTICAL_VARIANCE))
    inputs[s.IN_SPECIFIC_FORCE] = reading(core, thrust[0], drag) + residual
    inputs[s.IN_ACCELEROMETER_VARIANCE] = np.diag(R)
    result, outputs = np.empty(packed.size), np.empty(s.ACCELEROMETER_OUTPUTS)
    functions.Caller(functions.accelerometer_step(markers))((packed, inputs), (result, outputs))
    P = covariance_of(predicted, layout)
    H = np.zeros((3, layout.errors))
    H[:, : s.CORE_ERROR] = evaluated(me.specific_force_jacobian, core, thrust, drag)[0]
    S = H @ P @ H.T + R
    assert outputs[s.OUT_FORCE_NIS] == pytest.approx(residual @ np.linalg.solve(S, residual), rel=1e-9)
    if off > 1.0:
        assert outputs[s.OUT_FORCE_ACCEPTED] == 0.0
        np.testing.assert_allclose(result, predicted, atol=1e-12)
        return
    K = np.linalg.solve(S, H @ P).T
    for still in (s.D_ATTITUDE, s.D_BIAS, s.D_VELOCITY_WANDER, s.D_ATTITUDE_WANDER):
        K[still] = 0.0
    error = K @ residual
    assert outputs[s.OUT_FORCE_ACCEPTED] == 1.0
    np.testing.assert_allclose(result[: s.CORE_NOMINAL], plus_core(core, error[: s.CORE_ERROR]), atol=1e-9)
    left = np.eye(layout.errors) - K @ H
    after = left @ P @ left.T + K @ R @ K.T
    turned = 0.0 if not markers else 0.5 * float(np.linalg.norm(error[s.marker_error(0)][3:]))  # by the reset
    tolerance = 1e-9 + turned * float(np.abs(after).max())
    np.testing.assert_allclose(covariance_of(result, layout), after, atol=tolerance)


def test_the_error_is_as_large_as_the_filter_says() -> None:
    """Monte Carlo: NEES of the force and NIS inside their 95 % bounds, at half the sigma that odometry alone leaves."""
    airframe = f550(matching_window_s=1e9, accelerometer_sigma_m_s2=SIGMA)
    rng = np.random.default_rng(8)
    truth = flights(airframe, RUNS, rng)
    observers, without = [Observer(airframe) for _ in range(RUNS)], Observer(f550(matching_window_s=1e9))
    for observer in (*observers, without):
        fly_commands(observer, 2.0)
    forces, innovations = [], []
    for k in range(201):
        truth.advance(airframe, k * DT_S, rng)
        for run, (observer, sample) in enumerate(zip(observers, truth.odometry(airframe, rng), strict=True)):
            observer.add(sample)
            if run == 0:
                without.add(sample)
        if k % 2 or k == 0:
            continue
        felt = rotated(conjugates(truth.quaternion), truth.force - np.array(airframe.model.drag_1_s) * truth.velocity)
        felt += SIGMA * rng.standard_normal(felt.shape)
        for run, observer in enumerate(observers):
            observer.add(AccelerometerSample(truth.time_s, felt[run]))
        if k > 20:
            P = observers[0].covariance
            errors = [
                (truth.error(o, run)[s.D_FORCE], o.covariance[s.D_FORCE, s.D_FORCE]) for run, o in enumerate(observers)
            ]
            forces.append(np.mean([nees(error, covariance) for error, covariance in errors]))
            innovations.append(np.mean([o.statistics[s.ACCELEROMETER_SENSOR][0] for o in observers]))
    for averages, dof in ((forces, 3), (innovations, 2)):
        low, high = chi2.ppf((0.025, 0.975), RUNS * dof) / RUNS
        assert np.mean((np.array(averages) > low) & (np.array(averages) < high)) > 0.85
    sigmas = [math.sqrt(covariance[9, 9]) for covariance in (P, without.covariance)]
    assert sigmas[0] < 0.6 * sigmas[1]


def hover(
    observer: Observer, until_s: float, felt: Array | None, rng: np.random.Generator, begin_s: float = 0.0
) -> None:
    """A level hover against a steady force; the accelerometer reads `felt` with its noise, None where it is silent."""
    if begin_s == 0.0:
        observer.add(VehicleSample(-1.0, FlightMode.OFFBOARD, armed=True, in_air=True))
    for k in range(round(begin_s / DT_S), round(until_s / DT_S)):
        time_s = k * DT_S
        if k % 2 == 0:
            observer.sent(Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, HOVER - PUSH[2] / 28.54209), in_offboard=True)
        drift = np.array((PUSH[0], PUSH[1], 0.0)) * time_s  # it is blown away
        position = 0.5 * drift * time_s
        velocity = drift + 0.02 * rng.standard_normal(3)
        observer.add(OdometrySample(time_s, position, velocity, LEVEL, REST))
        if felt is not None and k % 2:
            observer.add(AccelerometerSample(time_s, felt + SIGMA * rng.standard_normal(3)))


def still_air_airframe(sigma: float | None = SIGMA) -> Observer:
    """An observer of an f550 without drag."""
    airframe = f550(force_density=0.5)
    noise = airframe.observer.model_copy(update={"accelerometer_sigma_m_s2": sigma})
    model = airframe.model.model_copy(update={"drag_1_s": (0.0, 0.0, 0.0)})
    return Observer(airframe.model_copy(update={"observer": noise, "model": model}))


def test_a_bias_is_learnt_and_leaves_the_force() -> None:
    """0.15 m/s^2 that PX4 has left in the readings: found within 20 s to 0.03, and then the force is right to that."""
    observer, bias = still_air_airframe(), np.array((0.15, -0.1, 0.0))
    hover(observer, 20.0, FELT + bias, np.random.default_rng(2))
    assert observer.moment is not None
    np.testing.assert_allclose(observer.accelerometer_bias, bias[:2], atol=0.03)
    np.testing.assert_allclose(observer.moment.packed[s.FORCE][:2], PUSH[:2], atol=0.15)


def test_the_noise_is_found_out() -> None:
    """Shaken four times as much as configured: the matched sigma says so, and little is refused."""
    observer, rng = still_air_airframe(SIGMA / 4.0), np.random.default_rng(3)
    hover(observer, 8.0, FELT, rng)
    assert observer.moment is not None
    assert math.sqrt(observer.moment.accelerometer.variance) == pytest.approx(SIGMA, rel=0.2)
    assert observer.counters.rejected[s.ACCELEROMETER_SENSOR] < 20


@pytest.mark.parametrize("garbage", [math.nan, math.inf, 1e30, 100.0, 0.0])
def test_garbage_is_refused_or_outvoted(garbage: float) -> None:
    """Not finite, absurd, far off, frozen: the estimate stays near the one of an observer that has no accelerometer."""
    felt, rng = FELT, np.random.default_rng(4)
    observer, alone = still_air_airframe(), still_air_airframe(None)
    hover(observer, 3.0, felt, rng)
    hover(observer, 6.0, np.full(3, garbage), rng, begin_s=3.0)
    hover(alone, 6.0, None, np.random.default_rng(5))
    for one in (observer, alone):
        estimate = one.estimate(6.0)
        assert estimate is not None
        np.testing.assert_allclose(estimate.force_in_world, PUSH, atol=0.5)
        np.testing.assert_allclose(estimate.velocity_in_world[:2], PUSH[:2] * 6.0, atol=0.1)
        assert np.isfinite(estimate.force_sigma_m_s2).all()


def test_without_samples_nothing_changes() -> None:
    """An accelerometer that is configured and silent leaves the same estimate, bit for bit."""
    estimates = []
    for observer in (still_air_airframe(), still_air_airframe(None)):
        hover(observer, 2.0, None, np.random.default_rng(6))
        estimates.append(observer.estimate(2.0))
    one, other = estimates
    assert one is not None
    assert other is not None
    assert one.force_in_world.tolist() == other.force_in_world.tolist()
    assert one.force_sigma_m_s2.tolist() == other.force_sigma_m_s2.tolist()


def test_late_samples_are_put_where_they_belong() -> None:
    """The same samples, each after the next odometry: the same estimate. Not so old ones, nor on the ground."""
    felt = AccelerometerSample(1.005, FELT)
    packed = []
    for late in (False, True):
        observer = still_air_airframe()
        hover(observer, 1.01, None, np.random.default_rng(7))
        if not late:
            observer.add(felt)
        observer.add(OdometrySample(1.01, REST, PUSH * 1.01, LEVEL, REST))
        if late:
            observer.add(felt)
        assert observer.moment is not None
        assert s.ACCELEROMETER_SENSOR in observer.statistics
        packed.append(observer.moment.packed)
    assert packed[0].tolist() == packed[1].tolist()
    observer.add(AccelerometerSample(0.9, felt.specific_force_in_body))
    assert observer.counters.dropped == 1
    observer.add(VehicleSample(1.02, FlightMode.OFFBOARD, armed=True, in_air=False))
    observer.statistics.clear()
    observer.add(AccelerometerSample(1.01, felt.specific_force_in_body))
    assert not observer.statistics
