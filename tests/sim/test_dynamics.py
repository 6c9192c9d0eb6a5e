from __future__ import annotations

from array import array

import numpy as np
import pytest

from tests.sim.plants import hovering, plant
from uasfly.messages import Array
from uasfly.sim.body import ROTOR_SPEED
from uasfly.sim.dynamics import STEP_S


def wild_flight(step_s: float, seconds: float = 1.0) -> Array:
    """State after a second of changing rotor targets and wind, both held over 8 ms whatever the step."""
    dynamics = hovering(plant("f550"), step_s=step_s)
    rng = np.random.default_rng(7)
    hover = dynamics.targets[0]
    for _ in range(round(seconds / 0.008)):
        dynamics.targets[:] = array("d", hover * (1.0 + 0.06 * rng.standard_normal(6)))
        dynamics.wind[:] = array("d", (*(4.0 * rng.standard_normal(3)), *(3.0 * rng.standard_normal(3))))
        for _ in range(round(0.008 / step_s)):
            dynamics.step()
    return np.array(dynamics.state)


def test_the_step_has_converged() -> None:
    """At 4 ms a wild second ends within 1e-6 of where steps of 0.5 ms end, and the error has fourth order."""
    exact = wild_flight(0.0005)
    error = np.abs(wild_flight(STEP_S) - exact)
    assert error[:3].max() < 1e-6  # m
    assert error[3:6].max() < 1e-6  # m/s
    assert error[6:10].max() < 1e-6
    assert error[10:13].max() < 1e-6  # rad/s
    coarse = np.abs(wild_flight(2 * STEP_S) - exact)
    assert coarse[10:13].max() / error[10:13].max() > 12.0


def test_hover_is_an_equilibrium() -> None:
    """At hover speed nothing moves."""
    dynamics = hovering(plant("aurelia_x6"))
    before = list(dynamics.state)
    for _ in range(250):
        dynamics.step()
    assert list(dynamics.state) == pytest.approx(before, abs=1e-6)


def test_a_weak_motor_lets_its_corner_sink() -> None:
    """A rotor with 70 % of its thrust lets the vehicle roll towards it."""
    figures = plant("f550")
    right = min(range(6), key=lambda index: figures.rotors.positions_m[index][1])
    dynamics = hovering(figures)
    dynamics.effectiveness[right] = 0.7
    for _ in range(25):
        dynamics.step()
    assert dynamics.state[10] > 0.3
    assert dynamics.state[5] < 0.0


def test_placing_starts_anew() -> None:
    """Placing a moving vehicle puts it at rest with its rotors stopped."""
    dynamics = hovering(plant("f550"))
    dynamics.state[3] = 4.0
    dynamics.place((1.0, 2.0, 0.0), 0.0, 1.0)
    assert list(dynamics.state[:10]) == [1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert not any(dynamics.state[ROTOR_SPEED.start :])
