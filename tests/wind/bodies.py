"""A body whose six axes all differ, and motions of it that are known exactly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from uasfly.messages import Array
from uasfly.wind.six_axes import TORQUES, SixAxisBody

BODY = SixAxisBody(mass_kg=1.5, inertia_kg_m2=(0.02, 0.03, 0.05), damping=0.01)


def nonlinear(body: SixAxisBody, state: Array, forces: Array) -> Array:
    """Newton's and Euler's equations as a textbook writes them: derivative of velocity and rates (6,)."""
    inertia = np.array(body.inertia_kg_m2)
    rates = state[TORQUES]
    torque = forces[TORQUES] - body.damping * rates - np.cross(rates, inertia * rates)
    return np.concatenate(((forces[:3] - body.damping * state[:3]) / body.mass_kg, torque / inertia))


def moved(body: SixAxisBody, start: Array, times_s: Array, forces: Callable[[float], Array]) -> Array:
    """States (n, 6) at these times under forces and torques (6,) of time."""
    solved = solve_ivp(
        lambda t, x: nonlinear(body, x, forces(t)),
        (times_s[0], times_s[-1]),
        start,
        t_eval=times_s,
        rtol=1e-10,
        atol=1e-12,
    )
    states: Array = solved.y.T
    return states
