"""One interval of the dynamics: accuracy, stability, Jacobian."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from uasfly.airframe import Airframe
from uasfly.control.transcription import interval_function, linearisation_function
from uasfly.messages import Array
from uasfly.model import INPUTS, PARAMETERS, ROLL, STATES, controller_dynamics, controller_parameters


def _random_point(rng: np.random.Generator) -> tuple[Array, Array, float, float]:
    state = np.concatenate((rng.normal(size=3), rng.normal(size=3), rng.uniform(-0.5, 0.5, 2)))
    inputs = np.array((rng.uniform(0.2, 0.7), *rng.uniform(-0.5, 0.5, 2)))
    return state, inputs, float(rng.uniform(-3.0, 3.0)), float(rng.uniform(-1.0, 1.0))


@pytest.fixture(scope="module")
def parameters(airframe: Airframe) -> Array:
    """Of the f550 in a wind that pushes."""
    return controller_parameters(airframe.model, np.array((0.7, -0.4, 0.3)), 27.0)


def test_an_interval_agrees_with_a_fine_integration(parameters: Array) -> None:
    """To 1e-7 on the first interval of the grid; to 2 cm, while the tilt swings by up to 60 degrees, on a late one."""
    symbols = [ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("p", PARAMETERS), ca.SX.sym("yaw")]
    dynamics = ca.Function("f", symbols, [controller_dynamics(*symbols)])
    interval = interval_function()
    rng = np.random.default_rng(5)
    for length, tolerance in ((0.02, 1e-7), (0.3, 2e-2)):
        for _ in range(5):
            state, inputs, yaw, rate = _random_point(rng)
            exact = solve_ivp(
                lambda t, x: np.asarray(dynamics(x, inputs, parameters, yaw + rate * t)).ravel(),  # noqa: B023
                (0.0, length),
                state,
                rtol=1e-11,
                atol=1e-12,
            ).y[:, -1]
            end = np.asarray(interval(state, inputs, parameters, yaw, rate, length)).ravel()
            np.testing.assert_allclose(end, exact, atol=tolerance)


def test_the_error_of_an_interval_falls_with_the_fifth_power_of_its_length(parameters: Array) -> None:
    """Halving the interval divides the local error by about 32, as of a method of order four."""
    interval = interval_function()
    state, inputs, yaw, rate = _random_point(np.random.default_rng(6))

    def whole_and_split(length: float) -> float:
        one = np.asarray(interval(state, inputs, parameters, yaw, rate, length)).ravel()
        many = state
        for n in range(16):
            step = length / 16
            many = np.asarray(interval(many, inputs, parameters, yaw + rate * n * step, rate, step)).ravel()
        return float(np.abs(one - many).max())

    assert 25.0 < whole_and_split(0.08) / whole_and_split(0.04) < 40.0


def test_the_attitude_is_the_matrix_exponential(parameters: Array) -> None:
    """Roll and pitch follow eq. 2 exactly for any length, ten time constants too."""
    interval = interval_function()
    state, inputs, yaw, rate = _random_point(np.random.default_rng(7))
    for axis, command, tau, gain in ((6, 1, parameters[0], parameters[1]), (7, 2, parameters[2], parameters[3])):
        for length in (0.02, 0.35, 1.4):
            system = np.array(((-1.0 / tau, gain / tau), (0.0, 0.0)))
            exact = (expm(system * length) @ (state[axis], inputs[command]))[0]
            end = np.asarray(interval(state, inputs, parameters, yaw, rate, length)).ravel()
            assert end[axis] == pytest.approx(exact, abs=1e-13)


def test_the_jacobian_agrees_with_finite_differences(parameters: Array) -> None:
    """Every entry of A and B, packed and unpacked, is the derivative of the defect."""
    linearise, pattern = linearisation_function()
    rng = np.random.default_rng(8)
    for length in (0.02, 0.3):
        state, inputs, yaw, rate = _random_point(rng)
        force, following = rng.normal(size=3), rng.normal(size=STATES)

        others = (parameters, force, yaw, rate, length, following)

        def defect(point: Array, others: tuple[Array | float, ...] = others) -> Array:
            return np.asarray(linearise(point[:STATES], point[STATES:], *others)[0]).ravel()

        point = np.concatenate((state, inputs))
        packed = linearise(state, inputs, *others)[1]
        a, b = pattern.dense(np.asarray(packed).reshape(1, -1))
        step = 1e-6
        numeric = np.stack(
            [(defect(point + step * unit) - defect(point - step * unit)) / (2 * step) for unit in np.eye(11)], axis=1
        )
        np.testing.assert_allclose(np.hstack((a[0], b[0])), numeric, atol=1e-8)


def test_the_stage_force_replaces_the_common_one(parameters: Array) -> None:
    """The force of a stage acts, not the one in the parameter vector."""
    linearise, _ = linearisation_function()
    state, inputs, yaw, rate = _random_point(np.random.default_rng(9))
    zero = np.zeros(3)
    still = np.asarray(linearise(state, inputs, parameters, zero, yaw, rate, 0.1, np.zeros(8))[0]).ravel()
    pushed = np.asarray(linearise(state, inputs, parameters, (1, 0, 0), yaw, rate, 0.1, np.zeros(8))[0]).ravel()
    assert (pushed - still)[3] == pytest.approx(0.1 * (1 - 0.5 * 0.1 * parameters[4]), rel=1e-3)
    np.testing.assert_allclose((pushed - still)[[1, 2, 4, 5, 6, 7]], 0.0, atol=1e-14)


def test_entries_that_never_vary_do_not_travel() -> None:
    """Of the 88 entries of [A B] 43 exist and 40 vary; the three ones of dp/dp stay in the code."""
    _, pattern = linearisation_function()
    assert pattern.sparsity.nnz() == 43
    assert pattern.size == 40
    assert sorted(set(pattern.constants)) == [0.0, 1.0]


def test_the_last_columns_of_a_packed_jacobian_are_those_of_the_dense_one() -> None:
    """From roll on every entry varies; columns with ones in them are refused."""
    _, pattern = linearisation_function()
    packed = np.random.default_rng(9).normal(size=pattern.size)
    symbol = ca.MX.sym("J", pattern.size)
    columns = ca.Function("columns", [symbol], [ca.densify(pattern.last_columns(symbol, ROLL))])
    a, b = pattern.dense(packed[None])
    np.testing.assert_array_equal(np.asarray(columns(packed)), np.hstack((a[0], b[0]))[:, ROLL:])
    with pytest.raises(ValueError, match="do not vary"):
        pattern.last_columns(symbol, 0)
