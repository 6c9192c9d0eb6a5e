"""The six-axis model and its eight rules."""

from __future__ import annotations

import numpy as np
import pytest

from tests.wind.bodies import BODY, nonlinear
from uasfly.airframe import GRAVITY_M_S2
from uasfly.errors import UasflyError
from uasfly.frames import quaternion_from_euler
from uasfly.wind.fuzzy import CORNERS, RATE_BOUND_RAD_S, blend, memberships, rule_matrices
from uasfly.wind.six_axes import TORQUES, SixAxisBody

Axes = tuple[float, float, float]
Figures = tuple[float, Axes] | tuple[float, Axes, float]


def test_the_model_is_newton_and_euler() -> None:
    """A(p, q, r) x + B u is what the equations of motion say, at any rates and inputs."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        state, inputs = rng.normal(size=6) * 8.0, rng.normal(size=6)
        model = BODY.system_matrix(state[TORQUES]) @ state + inputs / BODY.inertias
        np.testing.assert_allclose(model, nonlinear(BODY, state, inputs), rtol=1e-12, atol=1e-12)


def test_rules_add_up_to_the_model_inside_their_box() -> None:
    """Weights are not negative and sum to one; the blend is the nonlinear model, not an approximation of it."""
    rng = np.random.default_rng(2)
    rules = rule_matrices(BODY)
    for rates in rng.uniform(-RATE_BOUND_RAD_S, RATE_BOUND_RAD_S, (20, 3)):
        weights = memberships(rates)
        assert weights.min() >= 0.0
        assert weights.sum() == pytest.approx(1.0)
        np.testing.assert_allclose(blend(rates, rules), BODY.system_matrix(rates), rtol=1e-12, atol=1e-12)


def test_a_corner_has_its_own_rule_and_holds_beyond() -> None:
    """At a corner one rule holds alone; faster than that changes nothing."""
    for number, corner in enumerate(CORNERS):
        expected = np.eye(8)[number]
        np.testing.assert_allclose(memberships(corner), expected, atol=1e-15)
        np.testing.assert_allclose(memberships(3.0 * corner), expected, atol=1e-15)


def test_virtual_inputs_of_a_hover_and_of_a_tilted_vehicle() -> None:
    """Thrust of the weight, level: no force. Pitched by 30 degrees: half of the thrust along x."""
    weight = BODY.mass_kg * GRAVITY_M_S2
    torque = np.array((0.1, -0.2, 0.3))
    level = BODY.virtual_inputs(np.array((1.0, 0.0, 0.0, 0.0)), weight, torque)
    np.testing.assert_allclose(level, (0.0, 0.0, 0.0, 0.1, -0.2, 0.3), atol=1e-12)
    pitched = BODY.virtual_inputs(quaternion_from_euler(0.0, np.pi / 6.0, 0.0), weight, torque)
    np.testing.assert_allclose(pitched[:3], (0.5 * weight, 0.0, (np.sqrt(0.75) - 1.0) * weight), atol=1e-12)


@pytest.mark.parametrize(
    ("body", "name"),
    [
        ((0.0, (1.0, 1.0, 1.0)), "mass_kg"),
        ((1.0, (1.0, -1.0, 1.0)), "inertia_kg_m2"),
        ((1.0, (1.0, 1.0, 1.0), -1.0), "damping"),
    ],
)
def test_impossible_bodies_are_refused(body: Figures, name: str) -> None:
    """The message names the figure."""
    with pytest.raises(UasflyError, match=name):
        SixAxisBody(*body)
