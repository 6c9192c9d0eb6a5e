from __future__ import annotations

import math

import numpy as np
import pytest

from tests.sim.plants import PLANTS, plant
from uasfly.sim.dynamics import PlantDynamics

STEPS_A_SECOND = 250


def run(dynamics: PlantDynamics, seconds: float) -> np.ndarray:
    """Positions while time passes, (n, 3)."""
    rows = []
    for _ in range(round(seconds * STEPS_A_SECOND)):
        dynamics.step()
        rows.append(dynamics.state[0:3].tolist())
    return np.array(rows)


@pytest.mark.parametrize("name", PLANTS)
def test_a_resting_vehicle_neither_sinks_nor_creeps(name: str) -> None:
    """Placed on the ground the vehicle stays where it is, z = 0, for half a minute."""
    dynamics = PlantDynamics(plant(name))
    dynamics.place((3.0, -2.0, 0.0), math.cos(0.4), math.sin(0.4))
    positions = run(dynamics, 30.0)
    assert np.abs(positions - (3.0, -2.0, 0.0)).max() < 1e-4


@pytest.mark.parametrize("name", ["f550", "aurelia_x6"])
def test_a_resting_vehicle_stands_in_wind(name: str) -> None:
    """Wind that friction can hold does not move a parked vehicle."""
    dynamics = PlantDynamics(plant(name))
    dynamics.wind[0] = 8.0
    positions = run(dynamics, 30.0)
    assert np.abs(positions[:, :2]).max() < 2e-3
    assert np.abs(positions[-1] - positions[250]).max() < 1e-5


def test_a_gale_pushes_it_along() -> None:
    """Wind that pushes harder than friction makes the vehicle slide or tip downwind."""
    figures = plant("f550", {"gear.friction": 0.1})
    dynamics = PlantDynamics(figures)
    dynamics.wind[0] = 14.0
    assert run(dynamics, 3.0)[-1, 0] > 1.0


@pytest.mark.parametrize("name", ["f550", "px4_sih"])
def test_a_dropped_vehicle_comes_to_rest(name: str) -> None:
    """Dropped from half a metre, tilted and drifting, the vehicle ends level and still on the ground."""
    dynamics = PlantDynamics(plant(name))
    dynamics.place((0.0, 0.0, 0.5), 1.0, 0.0)
    dynamics.state[6], dynamics.state[7] = math.cos(0.05), math.sin(0.05)
    dynamics.state[3] = 0.5
    positions = run(dynamics, 4.0)
    assert positions[:, 2].min() > -0.12
    assert abs(positions[-1, 2]) < 1e-3
    assert np.abs(dynamics.state[3:6]).max() < 1e-3
    assert abs(dynamics.state[7]) < 1e-3
