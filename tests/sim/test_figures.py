"""Plants of one build share their functions; what tells them apart are arguments."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from tests.sim.plants import PLANTS, hovering, plant
from uasfly.sim.dynamics import STEP_S, WIND, plant_derivative, runge_kutta_step
from uasfly.sim.figures import Build, plant_figures, symbolic_plant
from uasfly.sim.ground import ANCHORS
from uasfly.sim.plant import Plant


def stepped_with_numbers(figures: Plant, state: np.ndarray, targets: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """A step of equations that have this plant's numbers written into them."""
    x = ca.SX.sym("x", state.size)
    sound = np.ones(targets.size)
    step, _ = runge_kutta_step(
        lambda at: plant_derivative(figures, at, ca.SX(targets), ca.SX(sound), ca.SX(wind), None), x, STEP_S
    )
    return np.asarray(ca.Function("step", [x], [step])(state)).ravel()


@pytest.mark.parametrize("name", PLANTS)
def test_shared_equations_move_a_plant_as_its_own_would(name: str) -> None:
    """In wind, with rotors that change speed, for the shipped plant and for a heavier one of the same build."""
    rng = np.random.default_rng(3)
    for changes in ({}, {"mass_kg": 1.1 * plant(name).mass_kg, "drag.linear_n_s_m": [0.2, 0.3, 0.4]}):
        figures = plant(name, changes)
        dynamics = hovering(figures)
        dynamics.wind[:] = dynamics.wind.__class__("d", rng.normal(size=WIND).tolist())
        for index in range(figures.rotors.count):
            dynamics.targets[index] *= 1.0 + 0.05 * rng.normal()
        before = np.array(dynamics.state)
        expected = stepped_with_numbers(figures, before, np.array(dynamics.targets), np.array(dynamics.wind))
        dynamics.step()
        np.testing.assert_allclose(np.array(dynamics.state), expected, rtol=1e-12, atol=1e-12)


def test_every_figure_of_the_equations_is_an_argument() -> None:
    """As many values as symbols; a change of any of them changes the slope, but for what only the battery uses."""
    figures = plant("f550")
    symbolic, symbols = symbolic_plant(figures)
    values = np.array(plant_figures(figures))
    assert symbols.numel() == values.size
    state, anchors = ca.SX.sym("state", 19), ca.SX.sym("anchors", ANCHORS)
    rate = plant_derivative(symbolic, state, ca.SX(np.full(6, 500.0)), ca.SX.ones(6), ca.SX(np.ones(WIND)), anchors)
    slope = ca.Function("slope", [symbols, state, anchors], [rate])
    at = np.array((0.1, 0.2, -0.01, 1.0, -1.0, -0.5, 0.99, 0.05, 0.05, 0.1, 0.3, -0.2, 0.1, *np.linspace(400, 500, 6)))
    at[6:10] /= np.linalg.norm(at[6:10])
    usual = np.asarray(slope(values, at, 0.01 * np.ones(ANCHORS)))
    idle = []
    for index in range(values.size):
        other = values.copy()
        other[index] = 1.01 * other[index] + 1e-3
        if np.array_equal(np.asarray(slope(other, at, 0.01 * np.ones(ANCHORS))), usual):
            idle.append(values[index])
    assert idle == [figures.rotors.full_speed_rad_s, figures.rotors.motor_resistance_ohm]


def test_a_build_is_the_form_of_the_equations() -> None:
    """Another mass is the same build; other rotors, another thrust law or step are not."""
    f550 = Build.of(plant("f550"), STEP_S)
    assert f550 == Build.of(plant("f550", {"mass_kg": 2.5}), STEP_S)
    assert hash(f550) == hash(Build.of(plant("aurelia_x6"), STEP_S))
    assert f550 != Build.of(plant("iris"), STEP_S)
    assert f550 != Build.of(plant("f550"), 0.5 * STEP_S)
    assert Build.of(plant("px4_sih"), STEP_S) != Build.of(plant("iris"), STEP_S)
