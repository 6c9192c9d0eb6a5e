from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from tests.sim.plants import hover_speed, hovering, number, plant
from uasfly.messages import Array
from uasfly.sim.body import ANGULAR_RATE, ROTOR_SPEED
from uasfly.sim.rotors import rotor_wrench, thrust_ratio


def ratio(axial: float, in_plane: float, slope: float) -> tuple[float, float]:
    """Value of the symbolic thrust ratio and its slope."""
    symbol = ca.SX.sym("v", 2)
    value = number(ca.vertcat(*thrust_ratio(symbol[0], symbol[1], slope)), symbol, [axial, in_plane**2])
    return float(value[0]), float(value[1])


def wrench(name: str, speeds: Array, air: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
    """Force and torque of a plant's rotors at rest in an airflow."""
    figures = plant(name)
    symbol = ca.SX.sym("w", figures.rotors.count)
    result = rotor_wrench(
        figures.rotors, symbol, symbol, ca.SX.ones(figures.rotors.count), ca.SX(ca.DM(air)), ca.SX.zeros(3)
    )
    value = number(ca.vertcat(result.force, result.torque), symbol, speeds)
    return value[:3], value[3:]


@pytest.mark.parametrize("slope", [0.6, 1.0, 1.4])
@pytest.mark.parametrize("in_plane", [0.0, 0.5, 1.5, 3.0])
@pytest.mark.parametrize("axial", [-0.8, -0.3, 0.0, 0.4, 1.5])
def test_inflow_satisfies_momentum_and_blade_element_theory(axial: float, in_plane: float, slope: float) -> None:
    """The thrust ratio is where momentum theory and blade-element theory meet, solved here by bisection."""

    def mismatch(induced: float) -> float:
        thrust = 1.0 - slope * (axial + induced - 1.0)
        return float(induced * np.hypot(in_plane, axial + induced) - thrust)

    induced = brentq(mismatch, 0.0, 4.0)
    assert ratio(axial, in_plane, slope)[0] == pytest.approx(1.0 - slope * (axial + induced - 1.0), abs=2e-3)


def test_hover_has_thrust_ratio_one() -> None:
    """Without airspeed the thrust is the hover thrust."""
    assert ratio(0.0, 0.0, 1.0)[0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("axial", "in_plane"), [(0.0, 0.0), (0.3, 0.5), (-0.3, 1.0)])
def test_axial_slope_is_the_derivative(axial: float, in_plane: float) -> None:
    """The slope by the axial airspeed agrees with finite differences."""
    difference = (ratio(axial + 1e-4, in_plane, 1.0)[0] - ratio(axial - 1e-4, in_plane, 1.0)[0]) / 2e-4
    assert ratio(axial, in_plane, 1.0)[1] == pytest.approx(difference, rel=5e-3)


def test_climbing_costs_thrust_and_side_wind_gives_some() -> None:
    """Air falling through the disc lowers thrust, air along it raises it (translational lift)."""
    assert ratio(0.3, 0.0, 1.0)[0] < 0.95
    assert ratio(-0.2, 0.0, 1.0)[0] > 1.03
    assert 1.05 < ratio(0.0, 1.0, 1.0)[0] < 1.3


@pytest.mark.parametrize("name", ["f550", "px4_sih"])
def test_torque_signs(name: str) -> None:
    """More thrust on the left rolls right, more at the front lifts the nose, more on clockwise rotors yaws left."""
    figures = plant(name)
    hover = np.full(figures.rotors.count, hover_speed(figures))
    force, torque = wrench(name, hover)
    assert force[2] == pytest.approx(figures.mass_kg * 9.80665, rel=1e-6)
    assert torque == pytest.approx(np.zeros(3), abs=1e-9)
    left = np.array([y > 1e-6 for _, y in figures.rotors.positions_m])
    front = np.array([x > 1e-6 for x, _ in figures.rotors.positions_m])
    clockwise = np.array(figures.rotors.spins) < 0
    assert wrench(name, hover * (1.0 + 0.05 * left))[1][0] > 0.01  # FLU: positive roll lowers the right side
    assert wrench(name, hover * (1.0 + 0.05 * front))[1][1] < -0.01  # FLU: positive pitch lowers the nose
    assert wrench(name, hover * (1.0 + 0.05 * clockwise))[1][2] > 1e-3


def test_flapping_pushes_along_with_the_air() -> None:
    """The in-plane force is linear in the airspeed along the disc, along it, and turns the nose away from the wind."""
    hover = np.full(6, hover_speed(plant("f550")))
    one, torque = wrench("f550", hover, (1.0, 0.0, 0.0))
    two, _ = wrench("f550", hover, (2.0, 0.0, 0.0))
    assert one[0] > 0.0
    assert two[0] == pytest.approx(2.0 * one[0])
    assert one[1] == 0.0
    assert torque[1] == pytest.approx(plant("f550").rotors.height_m * one[0])


def test_a_turning_vehicle_is_damped_by_its_rotors() -> None:
    """Rolling moves one side up into the air, where its rotors lose thrust: the roll is braked."""
    dynamics = hovering(plant("f550"))
    dynamics.state[ANGULAR_RATE.start] = 1.0
    dynamics.step()
    decay = (1.0 - dynamics.state[ANGULAR_RATE.start]) / 0.004
    assert 1.0 < decay < 4.0


def test_speed_follows_its_target_with_the_lag() -> None:
    """After one lag the speed has made 63 % of its way."""
    figures = plant("f550")
    dynamics = hovering(figures, step_s=figures.rotors.lag_s / 10)
    start = dynamics.state[ROTOR_SPEED.start]
    dynamics.targets[0] = start + 100.0
    for _ in range(10):
        dynamics.step()
    assert dynamics.state[ROTOR_SPEED.start] - start == pytest.approx(63.2, abs=0.1)


def test_a_rotor_that_speeds_up_turns_the_body_the_other_way() -> None:
    """Spinning up the counter-clockwise rotors turns the body clockwise at once, by their inertia."""
    figures = plant("f550", {"rotors.torque_per_thrust_m": 0.001})
    dynamics = hovering(figures)
    for index, spin in enumerate(figures.rotors.spins):
        dynamics.targets[index] += 50.0 * spin
    dynamics.step()
    assert dynamics.state[ANGULAR_RATE.start + 2] < -0.01
