"""The observer's gains and the inequality (11) that they have to satisfy, put to a semidefinite solver."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from tests.wind.bodies import BODY
from tests.wind.semidefinite import solve_inequalities, symmetric
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.wind.fuzzy import rule_matrices
from uasfly.wind.pole_circle import DP1, DP2, PoleCircle
from uasfly.wind.six_axes import SixAxisBody

PAPER = SixAxisBody(1.477, (0.1152, 0.1152, 0.218), damping=5.5e-4)
MARGIN = 1e-3
UPPER = 21  # numbers in a symmetric 6 x 6 matrix


def _common_lyapunov(circle: PoleCircle, loops: Array) -> Array | None:
    """X > I for which (11) holds with all these closed loops (8, 6, 6); None where there is none."""

    def rule(loop: Array, unknowns: Array) -> Array:
        return -circle.matrix_inequality(symmetric(unknowns, 6), loop) - MARGIN * np.eye(12)

    conditions = [functools.partial(rule, loop) for loop in loops]
    found = solve_inequalities(UPPER, [lambda x: symmetric(x, 6) - np.eye(6), *conditions])
    return None if found is None else symmetric(found, 6)


@pytest.mark.parametrize("circle", [DP1, DP2])
@pytest.mark.parametrize("body", [PAPER, BODY])
def test_the_gains_have_one_lyapunov_matrix_for_all_rules(circle: PoleCircle, body: SixAxisBody) -> None:
    """The solver finds X > 0, and with it (11) is negative definite for each of the eight rules."""
    rules = rule_matrices(body)
    loops = rules - circle.central_gains(rules)
    lyapunov = _common_lyapunov(circle, loops)
    assert lyapunov is not None
    assert np.linalg.eigvalsh(lyapunov).min() > 0.99
    for loop in loops:
        assert np.linalg.eigvalsh(circle.matrix_inequality(lyapunov, loop)).max() < 0.0
        np.testing.assert_allclose(np.linalg.eigvals(loop), -circle.cutoff_rad_s, rtol=1e-9)


def test_gains_that_do_not_go_with_the_rates_have_none() -> None:
    """With the gain of the vehicle at rest for all rules no X is found for DP1: poles lie outside its circle."""
    rules = rule_matrices(PAPER)
    at_rest = PAPER.system_matrix(np.zeros(3))[None]
    loops = rules - DP1.central_gains(at_rest)
    away = np.abs(np.linalg.eigvals(loops) + DP1.cutoff_rad_s).max()
    assert away > 2.0 * np.pi * DP1.radius_hz
    assert _common_lyapunov(DP1, loops) is None


def test_gains_for_another_circle_have_none() -> None:
    """DP2's gains are not in DP1's circle."""
    rules = rule_matrices(PAPER)
    assert _common_lyapunov(DP1, rules - DP2.central_gains(rules)) is None


def test_gains_from_the_inequality_itself_lie_in_the_circle() -> None:
    """With Y_i = X L_i unknown as well (11) is linear: the solver's own gains put all poles of all rules inside."""
    rules = rule_matrices(PAPER)
    radius, centre = 2.0 * np.pi * DP1.radius_hz, DP1.cutoff_rad_s

    def matrices(unknowns: Array) -> tuple[Array, Array]:
        return symmetric(unknowns[:UPPER], 6), unknowns[UPPER:].reshape(8, 6, 6)

    def rule(number: int, unknowns: Array) -> Array:
        lyapunov, products = matrices(unknowns)
        offset = lyapunov @ rules[number] - products[number] + centre * lyapunov
        return np.block([[radius * lyapunov, -offset], [-offset.T, radius * lyapunov]]) - MARGIN * np.eye(12)

    conditions = [functools.partial(rule, number) for number in range(8)]
    found = solve_inequalities(UPPER + 8 * 36, [lambda x: symmetric(x[:UPPER], 6) - np.eye(6), *conditions])
    assert found is not None
    lyapunov, products = matrices(found)
    for system, product in zip(rules, products, strict=True):
        poles = np.linalg.eigvals(system - np.linalg.solve(lyapunov, product))
        assert np.abs(poles + centre).max() < radius


@pytest.mark.parametrize(
    ("cutoff", "radius"), [(1.0, 1.0), (1.0, 0.0), (-1.0, 0.5), (float("nan"), 0.5), (float("inf"), 0.5)]
)
def test_circles_that_reach_the_unstable_side_are_refused(cutoff: float, radius: float) -> None:
    """The message says what is expected."""
    with pytest.raises(UasflyError, match="radius_hz < cutoff_hz"):
        PoleCircle(cutoff, radius)
