from __future__ import annotations

import math

import numpy as np
import pytest

from tests.sim.plants import hovering, plant
from uasfly.sim.body import VELOCITY
from uasfly.sim.dynamics import FREE, JET, PlantDynamics


def acceleration(name: str, free: tuple[float, float, float], jet: tuple[float, float, float]) -> np.ndarray:
    """Acceleration [m/s^2] of a hovering plant at the moment that the wind begins."""
    dynamics = hovering(plant(name))
    for axis in range(3):
        dynamics.wind[FREE.start + axis] = free[axis]
        dynamics.wind[JET.start + axis] = jet[axis]
    dynamics.step()
    return np.array(dynamics.acceleration)


@pytest.mark.parametrize(("speed", "push"), [(10.0, 1.55), (7.0, 0.76), (13.4, 2.78)])
def test_a_jet_pushes_the_f550_as_the_paper_measured(speed: float, push: float) -> None:
    """A jet of v m/s pushes the hovering f550 with 0.0155 v^2 m/s^2 along it, whatever its direction."""
    for direction in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (math.cos(0.5), 0.0, -math.sin(0.5))):
        x, y, z = (speed * part for part in direction)
        assert acceleration("f550", (0.0, 0.0, 0.0), (x, y, z)) == pytest.approx(push * np.array(direction), abs=0.01)


def test_free_wind_also_acts_on_the_rotors() -> None:
    """The same air as free wind pushes harder than as a jet: the rotors flap in it."""
    wind = acceleration("f550", (5.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    jet = acceleration("f550", (0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    assert jet[0] == pytest.approx(0.0155 * 25.0, rel=0.01)
    assert wind[0] == pytest.approx(jet[0] + 0.237 * 5.0, rel=0.05)
    assert wind[2] > 0.3  # translational lift
    assert jet[2] == pytest.approx(0.0, abs=1e-6)


def test_jet_and_free_wind_add_up_before_the_square() -> None:
    """The body feels the sum of both winds, not the sum of their drags."""
    both = acceleration("px4_sih", (2.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    assert both[0] == pytest.approx(5.0)


def test_moving_with_the_wind_feels_nothing() -> None:
    """A vehicle that drifts with the free wind hovers as in still air."""
    dynamics = hovering(plant("f550"))
    dynamics.wind[0], dynamics.wind[1] = 6.0, -2.0
    dynamics.state[3], dynamics.state[4] = 6.0, -2.0
    dynamics.step()
    assert dynamics.acceleration.tolist() == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)


def test_terminal_velocity() -> None:
    """With stopped rotors the fall ends where drag carries the weight: v = sqrt(2 m g / (rho C_D A))."""
    figures = plant("f550")
    dynamics = PlantDynamics(figures)
    dynamics.place((0.0, 0.0, 2000.0), 1.0, 0.0)
    for _ in range(5000):
        dynamics.step()
    expected = math.sqrt(2.0 * figures.mass_kg * 9.80665 / (1.225 * figures.drag.area_m2[2]))
    assert -dynamics.state[VELOCITY.stop - 1] == pytest.approx(expected, rel=1e-3)


def test_wind_force_is_what_the_wind_adds() -> None:
    """The force of the truth is the acceleration with wind minus that of the same motion in still air."""
    figures = plant("f550")
    windy, still = hovering(figures), hovering(figures)
    for dynamics in (windy, still):
        dynamics.state[3:6] = type(dynamics.state)("d", (1.0, -2.0, 0.3))
    windy.wind[:] = type(windy.wind)("d", (4.0, 1.0, -0.5, 2.0, 0.0, 0.0))
    force = np.array(windy.wind_force())
    windy.step()
    still.step()
    assert np.linalg.norm(force) > 1.0
    assert force == pytest.approx(np.array(windy.acceleration) - np.array(still.acceleration), abs=1e-9)
    assert still.wind_force() == (0.0, 0.0, 0.0)
