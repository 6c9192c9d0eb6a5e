"""Keeps the simulated quadrotor on its course: proportional-derivative on position, then on attitude.

It knows nothing of the gust and uses no observer, so every observer watches one and the same flight. The paper does not
say which controller flew its spiral; the observers' estimates depend on it only through the uncertainty's share of the
inputs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import rotation_matrix
from uasfly.messages import Array
from uasfly.reproduce.asignacion2022.vehicle import Vehicle
from uasfly.wind.six_axes import FORCES, TORQUES, SixAxisBody

POSITION_RAD_S = 1.5  # natural frequencies and damping ratios of the two loops
POSITION_RATIO = 1.0
ATTITUDE_RAD_S = 12.0
ATTITUDE_RATIO = 0.8


@dataclass(frozen=True, slots=True)
class Course:
    """A helix about the world's z, or a hover where the radius and the climb are zero.

    Attributes:
        radius_m, turn_rad_s, climb_m_s: of the helix; it begins at (radius, 0, 0).
    """

    radius_m: float = 0.0
    turn_rad_s: float = 0.0
    climb_m_s: float = 0.0

    def at(self, time_s: float) -> tuple[Array, Array, Array]:
        """Position [m], velocity [m/s] and acceleration [m/s^2] in the world, each (3,)."""
        turn = self.turn_rad_s
        along, across = self.radius_m * math.cos(turn * time_s), self.radius_m * math.sin(turn * time_s)
        return (
            np.array((along, across, self.climb_m_s * time_s)),
            np.array((-turn * across, turn * along, self.climb_m_s)),
            np.array((-turn * turn * along, -turn * turn * across, 0.0)),
        )


def control(body: SixAxisBody, vehicle: Vehicle, course: Course) -> tuple[float, Array]:
    """Thrust [N] and torque in the body (3,) [N m] for the vehicle's state now; the nose points along the world's x."""
    position, velocity, acceleration = course.at(vehicle.time_s)
    state = vehicle.state
    rates = state[TORQUES]
    force = acceleration + POSITION_RAD_S**2 * (position - vehicle.position_m)
    force += 2.0 * POSITION_RATIO * POSITION_RAD_S * (velocity - state[FORCES])
    force[2] += GRAVITY_M_S2
    force *= body.mass_kg
    attitude = rotation_matrix(vehicle.quaternion)
    up = force / np.linalg.norm(force)
    left = np.array((0.0, up[2], -up[1]))  # up x (1, 0, 0)
    left /= np.linalg.norm(left)
    wanted = np.column_stack((np.cross(left, up), left, up))
    away = wanted.T @ attitude
    error = 0.5 * np.array((away[2, 1] - away[1, 2], away[0, 2] - away[2, 0], away[1, 0] - away[0, 1]))
    inertia = np.array(body.inertia_kg_m2)
    torque = -inertia * (ATTITUDE_RAD_S**2 * error + 2.0 * ATTITUDE_RATIO * ATTITUDE_RAD_S * rates)
    torque += np.cross(rates, inertia * rates)
    return float(force @ attitude[:, 2]), torque
