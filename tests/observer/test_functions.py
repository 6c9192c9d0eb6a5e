from __future__ import annotations

import numpy as np
import pytest

from tests.observer.manifold import evaluated, flying_inputs, plus_core, plus_pose, random_core, random_pose
from tests.observer.test_measurements import attitude_as_told
from tests.observer.truth import turn_between
from uasfly.messages import Array
from uasfly.observer import error_state as es
from uasfly.observer import functions
from uasfly.observer import measurements as me
from uasfly.observer import states as s
from uasfly.observer.update import GATE_3

VARIANCES = (0.01**2, 0.02**2, 0.05**2)


def packed_state(markers: int, rng: np.random.Generator) -> Array:
    """A packed state with a well-mixed covariance."""
    layout = s.Layout(markers)
    root = 0.01 * rng.standard_normal((layout.errors, layout.errors))
    matched = [variance * np.eye(3) for variance in VARIANCES]
    return np.concatenate(
        (
            random_core(rng),
            *(random_pose(rng) for _ in range(markers)),
            (root @ root.T).ravel(),
            *(block.ravel() for block in matched),
            np.zeros(9),
        )
    )


def odometry_inputs(core: Array, rng: np.random.Generator) -> Array:
    """Inputs of a step whose measurements lie close to the predicted state."""
    inputs = np.zeros(s.ODOMETRY_INPUTS)
    inputs[: s.PREDICTION_INPUTS] = flying_inputs(rng, 0.01)
    predicted = evaluated(es.predict_nominal, core, inputs[: s.PREDICTION_INPUTS])[0]
    seen = plus_core(predicted, 0.01 * rng.standard_normal(s.CORE_ERROR))
    inputs[s.IN_QUATERNION] = attitude_as_told(seen)
    inputs[s.IN_POSITION] = seen[s.POSITION] + seen[s.BIAS]
    inputs[s.IN_VELOCITY] = seen[s.VELOCITY] + seen[s.VELOCITY_WANDER]
    inputs[s.IN_USE] = 1.0
    inputs[s.IN_CORRELATION] = (1.0, 3.0, 2.0)
    inputs[s.IN_VARIANCE] = VARIANCES
    inputs[s.IN_WEIGHTS] = (0.01, 0.01, 0.04, 1.0, 1.0, 1.0)
    return inputs


def evaluate_step(packed: Array, inputs: Array, markers: int) -> tuple[Array, Array]:
    """New packed state and outputs of the generated odometry step."""
    result, outputs = np.empty(packed.size), np.empty(s.ODOMETRY_OUTPUTS)
    functions.Caller(functions.odometry_step(markers))((packed, inputs), (result, outputs))
    return result, outputs


def covariance_of(packed: Array, layout: s.Layout) -> Array:
    """Covariance (n, n) in a packed state."""
    return packed[layout.covariance].reshape(layout.errors, layout.errors)


@pytest.mark.parametrize("markers", [0, 1])
@pytest.mark.parametrize("bias_free", [0.0, 1.0])
def test_an_odometry_step_is_the_textbook_filter(markers: int, bias_free: float) -> None:
    """Prediction, one update by all nine numbers at once, injection and reset, written out in numpy, give the same."""
    rng = np.random.default_rng(3 + markers)
    layout, packed = s.Layout(markers), packed_state(markers, rng)
    inputs = odometry_inputs(packed[: s.CORE_NOMINAL], rng)
    inputs[s.IN_BIAS_FREE] = inputs[s.IN_WANDER_FREE] = bias_free
    result, outputs = evaluate_step(packed, inputs, markers)

    motion = inputs[: s.PREDICTION_INPUTS]
    core = packed[: s.CORE_NOMINAL]
    n = layout.errors
    Phi, Q = np.eye(n), np.zeros((n, n))
    core_part = slice(0, s.CORE_ERROR)
    Phi[core_part, core_part] = evaluated(es.transition, core, motion)[0]
    Q[core_part, core_part] = evaluated(es.noise_covariance, core, motion)[0]
    P = Phi @ covariance_of(packed, layout) @ Phi.T + Q
    predicted = evaluated(es.predict_nominal, core, motion)[0]
    allowed = np.eye(n)
    if not bias_free:
        allowed[s.D_POSITION, s.D_BIAS] = np.eye(3)
        allowed[s.D_BIAS, s.D_BIAS] = allowed[s.D_VELOCITY_WANDER, s.D_VELOCITY_WANDER] = 0.0
    errors = np.zeros(n)
    for k, part in enumerate((s.D_ATTITUDE, s.D_POSITION, s.D_VELOCITY)):
        H = np.zeros((3, n))
        H[:, part] = np.eye(3)
        if k == s.ATTITUDE_SENSOR:
            H[:, core_part] = evaluated(lambda x: me.odometry_jacobian(x, s.ATTITUDE_SENSOR), predicted)[0]
        else:
            H[:, s.D_BIAS if k == s.POSITION_SENSOR else s.D_VELOCITY_WANDER] = np.eye(3)
        innovation = (
            turn_between(attitude_as_told(predicted), inputs[s.IN_QUATERNION]),
            inputs[s.IN_POSITION] - predicted[s.POSITION] - predicted[s.BIAS],
            inputs[s.IN_VELOCITY] - predicted[s.VELOCITY] - predicted[s.VELOCITY_WANDER],
        )[k] - H @ errors
        S = H @ P @ H.T + VARIANCES[k] * np.eye(3)
        assert outputs[s.OUT_NIS][k] == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-8)
        assert outputs[s.OUT_ACCEPTED][k] == 1.0
        R = VARIANCES[k] * inputs[s.IN_CORRELATION][k] * np.eye(3)
        K = allowed @ P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        errors = errors + K @ innovation
        P = (np.eye(n) - K @ H) @ P @ (np.eye(n) - K @ H).T + K @ R @ K.T
    reset = np.eye(n)
    reset[6:9, 6:9] = evaluated(es.reset_jacobian, errors[6:9])[0]
    expected = [plus_core(predicted, errors[core_part])]
    for k in range(markers):
        part = s.marker_error(k)
        reset[part.start + 3 : part.stop, part.start + 3 : part.stop] = evaluated(es.reset_jacobian, errors[part][3:])[
            0
        ]
        expected.append(plus_pose(packed[s.marker_nominal(k)], errors[part]))
    np.testing.assert_allclose(result[layout.nominal], np.concatenate(expected), atol=1e-10)
    np.testing.assert_allclose(covariance_of(result, layout), reset @ P @ reset.T, atol=1e-12)
    if not bias_free:
        np.testing.assert_array_equal(result[s.BIAS], packed[s.BIAS])


def test_the_covariance_stays_symmetric_bit_for_bit() -> None:
    """After each of a hundred steps."""
    rng = np.random.default_rng(5)
    layout, packed = s.Layout(0), packed_state(0, rng)
    for _ in range(100):
        packed, _ = evaluate_step(packed, odometry_inputs(packed[: s.CORE_NOMINAL], rng), 0)
        P = covariance_of(packed, layout)
        assert np.array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > 0.0


@pytest.mark.parametrize("sensor", range(3))
def test_a_measurement_outside_its_gate_predicts_and_enters_the_matching_only(sensor: int) -> None:
    """The state moves as by the other two sensors alone; the matched covariance of this one grows by a tenth."""
    rng = np.random.default_rng(6)
    packed = packed_state(0, rng)
    inputs = odometry_inputs(packed[: s.CORE_NOMINAL], rng)
    off = inputs.copy()
    off[s.IN_USE.start + sensor] = 0.0
    without, _ = evaluate_step(packed, off, 0)
    far = inputs.copy()
    if sensor == s.ATTITUDE_SENSOR:
        far[s.IN_QUATERNION] = random_core(rng)[s.QUATERNION]
    else:
        far[(s.IN_POSITION, s.IN_VELOCITY)[sensor - 1]] += 1000.0
    result, outputs = evaluate_step(packed, far, 0)
    layout = s.Layout(0)
    assert outputs[s.OUT_ACCEPTED][sensor] == 0.0
    assert outputs[s.OUT_NIS][sensor] > GATE_3
    np.testing.assert_allclose(result[layout.nominal], without[layout.nominal], atol=1e-12)
    np.testing.assert_allclose(result[layout.covariance], without[layout.covariance], atol=1e-15)
    grown = result[layout.matched][9 * sensor : 9 * sensor + 9].reshape(3, 3).trace() / (3 * VARIANCES[sensor])
    assert 1.0 < grown < 1.15


def test_a_mere_prediction_is_the_odometry_steps_prediction() -> None:
    """With no sensor in use the step is the prediction."""
    rng = np.random.default_rng(7)
    for markers in (0, 1):
        packed = packed_state(markers, rng)
        inputs = odometry_inputs(packed[: s.CORE_NOMINAL], rng)
        inputs[s.IN_USE] = 0.0
        step, _ = evaluate_step(packed, inputs, markers)
        predicted, extrapolated = np.empty(packed.size), np.empty(s.CORE_NOMINAL)
        functions.Caller(functions.prediction(markers))((packed, inputs), (predicted,))
        functions.Caller(functions.extrapolation())((packed, inputs), (extrapolated,))
        np.testing.assert_allclose(step, predicted, atol=1e-14)
        np.testing.assert_allclose(predicted[: s.CORE_NOMINAL], extrapolated, atol=1e-14)


def test_numbers_of_absurd_size_do_no_harm() -> None:
    """A finite measurement of 1e7 is refused and leaves nothing but finite numbers."""
    rng = np.random.default_rng(8)
    packed = packed_state(0, rng)
    inputs = odometry_inputs(packed[: s.CORE_NOMINAL], rng)
    inputs[s.IN_POSITION] = 1e7
    inputs[s.IN_VELOCITY] = -1e7
    result, outputs = evaluate_step(packed, inputs, 0)
    assert np.all(np.isfinite(result))
    assert outputs[s.OUT_ACCEPTED].tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("markers", [0, 1])
def test_compiled_steps_are_those_of_the_virtual_machine(markers: int) -> None:
    """To rounding; without a compiler they are the same functions."""
    rng = np.random.default_rng(31)
    packed = packed_state(markers, rng)
    inputs = odometry_inputs(packed[: s.CORE_NOMINAL], rng)
    expected = evaluate_step(packed, inputs, markers)
    predict, update, _ = functions.compiled_steps(markers)
    result, outputs, predicted = np.empty(packed.size), np.empty(s.ODOMETRY_OUTPUTS), np.empty(packed.size)
    functions.Caller(update)((packed, inputs), (result, outputs))
    functions.Caller(predict)((packed, inputs), (predicted,))
    np.testing.assert_allclose(result, expected[0], rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(outputs, expected[1], rtol=1e-9, atol=1e-13)
    other = np.empty(packed.size)
    functions.Caller(functions.prediction(markers))((packed, inputs), (other,))
    np.testing.assert_allclose(predicted, other, rtol=1e-9, atol=1e-13)


def test_a_caller_looks_at_the_arrays_of_each_call() -> None:
    """New arrays, changed arrays and arrays of before, in turn."""
    call, rng = functions.Caller(functions.extrapolation()), np.random.default_rng(32)
    cores = [random_core(rng) for _ in range(2)]
    inputs = flying_inputs(rng, 0.01)
    results = []
    for core in (cores[0], cores[1], cores[0]):
        result = np.empty(s.CORE_NOMINAL)
        call((core, inputs), (result,))
        results.append(result)
    np.testing.assert_array_equal(results[0], results[2])
    assert np.abs(results[0] - results[1]).max() > 0.0
    cores[0][0] += 1.0
    call((cores[0], inputs), (results[1],))
    assert results[1][0] == pytest.approx(results[0][0] + 1.0)
