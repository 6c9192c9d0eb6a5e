"""The observers' steps in time against the matrix exponential and against an integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tests.wind.bodies import BODY
from uasfly.messages import Array
from uasfly.wind.exact_step import exact_step
from uasfly.wind.fuzzy_observer import FuzzyDisturbanceObserver
from uasfly.wind.pole_circle import DP1, DP2, PoleCircle
from uasfly.wind.six_axes import TORQUES


@pytest.mark.parametrize("step_s", [1e-4, 0.02, 0.4])
def test_a_quadratic_drive_is_integrated_exactly(step_s: float) -> None:
    """At short and long steps, for oscillating and decaying systems side by side."""
    rng = np.random.default_rng(3)
    system = np.array(((-40.0, 3.0), (-9.0, 0.0)))
    state, constant, slope, curve = rng.normal(size=(4, 2))

    def drive(time_s: float) -> Array:
        share = time_s / step_s
        value: Array = constant + slope * share + curve * share**2
        return value

    columns = [drive(share * step_s)[:, None] for share in (0.0, 0.5, 1.0)]
    stepped = exact_step(system, step_s).advance(state[:, None], *columns)[:, 0]
    solved = solve_ivp(lambda t, x: system @ x + drive(t), (0.0, step_s), state, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(stepped, solved.y[:, -1], rtol=1e-8, atol=1e-11)


@pytest.mark.parametrize("circle", [DP1, DP2])
def test_the_fuzzy_observer_steps_as_the_matrix_exponential_of_all_six_axes_does(circle: PoleCircle) -> None:
    """With the rates held over the step A and L are constant: x^' = (A - L) x^ + L x + B u, x linear, u held."""
    rng = np.random.default_rng(4)
    step_s = 0.03
    before, after, inputs = rng.normal(size=(3, 6))
    after[TORQUES] = before[TORQUES] = (3.0, -7.0, 5.0)
    observer = FuzzyDisturbanceObserver(BODY, circle)
    observer.update(1.0, before, inputs)
    found = observer.update(1.0 + step_s, after, inputs)

    A = BODY.system_matrix(before[TORQUES])
    L = A + circle.cutoff_rad_s * np.eye(6)
    chain = np.zeros((24, 24))  # x^, x, x', u
    chain[:6] = np.hstack((A - L, L, np.zeros((6, 6)), np.diag(1.0 / BODY.inertias)))
    chain[6:12, 12:18] = np.eye(6)
    whole = expm(chain * step_s) @ np.concatenate((before, before, (after - before) / step_s, inputs))
    expected = BODY.inertias * circle.cutoff_rad_s * (after - whole[:6])
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_rates_that_change_over_the_step_are_followed_exactly() -> None:
    """States linear over the step make the drive quadratic; an integrator finds the same estimate."""
    rng = np.random.default_rng(5)
    step_s = 0.1
    before, after, inputs = rng.uniform(-8.0, 8.0, (3, 6))
    observer = FuzzyDisturbanceObserver(BODY, DP1)
    observer.update(0.0, before, inputs)
    found = observer.update(step_s, after, inputs)

    def slope(time_s: float, estimate: Array) -> Array:
        state = before + (after - before) * time_s / step_s
        A = BODY.system_matrix(state[TORQUES])
        value: Array = A @ estimate + (A + DP1.cutoff_rad_s * np.eye(6)) @ (state - estimate) + inputs / BODY.inertias
        return value

    estimate = solve_ivp(slope, (0.0, step_s), before, rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(found, BODY.inertias * DP1.cutoff_rad_s * (after - estimate), rtol=1e-7, atol=1e-8)
