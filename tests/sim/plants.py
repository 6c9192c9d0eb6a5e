"""Plants, scenarios and evaluation helpers that the tests of the simulation share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType

import casadi as ca
import numpy as np

from uasfly.files import find_file, load_file
from uasfly.messages import Array
from uasfly.sim.body import GRAVITY_M_S2, ROTOR_SPEED
from uasfly.sim.dynamics import PlantDynamics
from uasfly.sim.plant import Plant

PLANTS = ("aurelia_x6", "f550", "iris", "px4_sih")
NO_CHANGES: Mapping[str, object] = MappingProxyType({})


def plant(name: str, changes: Mapping[str, object] = NO_CHANGES) -> Plant:
    """A shipped plant, with some values changed."""
    return load_file(find_file("plant", name), Plant, changes)


def k_thrust(figures: Plant) -> float:
    """Thrust acceleration of all rotors at full command and reference voltage [m/s^2]."""
    full = figures.rotors.static_thrust_n(figures.rotors.full_speed_rad_s)
    return figures.rotors.count * full / figures.mass_kg


def hover_speed(figures: Plant) -> float:
    """Rotor speed that carries the weight in still air [rad/s]."""
    share = GRAVITY_M_S2 / k_thrust(figures)
    return float(figures.rotors.full_speed_rad_s * share ** (1.0 / figures.rotors.speed_exponent))


def hovering(figures: Plant, height_m: float = 20.0, step_s: float = 0.004) -> PlantDynamics:
    """A plant in the air, level, with its rotors turning at hover speed."""
    dynamics = PlantDynamics(figures, step_s)
    dynamics.place((0.0, 0.0, height_m), 1.0, 0.0)
    for index in range(figures.rotors.count):
        dynamics.targets[index] = dynamics.state[ROTOR_SPEED.start + index] = hover_speed(figures)
    return dynamics


def number(expression: ca.SX, variable: ca.SX, value: Array | list[float]) -> Array:
    """Value of an expression of one vector."""
    return np.array(ca.Function("f", [variable], [expression])(value)).squeeze()


def roll_pitch(attitude: Iterable[float]) -> tuple[float, float]:
    """Roll and pitch [rad] of a quaternion body to world."""
    w, x, y, z = (float(v) for v in attitude)
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.asin(2 * (w * y - x * z))
