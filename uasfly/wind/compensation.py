"""Tilt that balances the wind's drag at the present thrust (Waslander & Wang 2009, eq. 31 and 32)."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array


def tilt_offsets(wind_acceleration_in_world: Array, yaw_rad: float, thrust_m_s2: float) -> tuple[float, float]:
    """Roll and pitch [rad] under which the thrust's horizontal part cancels the wind's; finite for finite arguments.

    Args:
        wind_acceleration_in_world: (3,) [m/s^2] drag of the wind over the mass; only its horizontal part is balanced.
        yaw_rad: heading of the vehicle.
        thrust_m_s2: present thrust over the mass, greater than 0.
    """
    east, north, _ = wind_acceleration_in_world.tolist()
    forward = math.cos(yaw_rad) * east + math.sin(yaw_rad) * north
    left = math.cos(yaw_rad) * north - math.sin(yaw_rad) * east
    # Body z in the world has the parts sin(pitch) cos(roll) forward and -sin(roll) to the left.
    roll = math.asin(float(np.clip(left / thrust_m_s2, -1.0, 1.0)))
    level = max(thrust_m_s2 * math.cos(roll), 1e-9)
    pitch = math.asin(float(np.clip(-forward / level, -1.0, 1.0)))
    return roll, pitch
