"""What the vehicle can hold, and what the controller may therefore plan against.

A force beyond the limits of tilt and thrust, or a reference far away, makes the plan's cost enormous and its optimum a
corner of every bound; one Newton step a sample then jumps from corner to corner. Planning against the strongest force
that can be held, towards a point that is near, gives the same saturated tilt without the jumps, and keeps the height.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Limits
from uasfly.messages import Array

TILT_SHARE = 0.95  # of the largest horizontal acceleration; the rest is left to steer with
THRUST_SHARE = 0.9  # of the thrust left over by gravity at that tilt
FARTHEST_M = 3.0  # a reference farther away than this is approached as if it were this far


def holdable_force(force_in_world: Array, limits: Limits, k_thrust_m_s2: float) -> Array:
    """The force (3,) [m/s^2], shortened to what can be held: the vertical part first, then the horizontal one.

    Args:
        force_in_world: (3,) estimated, finite.
        limits: tilt and thrust.
        k_thrust_m_s2: thrust acceleration at full command.
    """
    east, north, up = force_in_world.tolist()
    strongest, weakest = k_thrust_m_s2 * limits.thrust_max, k_thrust_m_s2 * limits.thrust_min
    cosine = math.cos(limits.tilt_rad)
    lowest = -THRUST_SHARE * max(0.0, strongest * cosine - GRAVITY_M_S2)
    highest = THRUST_SHARE * max(0.0, GRAVITY_M_S2 - weakest)
    up_held = min(max(up, lowest), highest)
    horizontal = math.hypot(east, north)
    most = TILT_SHARE * (GRAVITY_M_S2 - up_held) * math.tan(limits.tilt_rad)
    scale = 1.0 if horizontal <= most else most / horizontal
    if scale == 1.0 and up_held == up:
        return force_in_world
    return np.array((scale * east, scale * north, up_held))


def nearby(positions: Array, position_in_world: Array) -> Array:
    """Reference positions (n, 3) [m], all moved so that the first is at most FARTHEST_M from `position_in_world`."""
    offset = positions[0] - position_in_world
    distance = math.sqrt(float(offset @ offset))
    if distance <= FARTHEST_M:
        return positions
    moved: Array = positions - (1.0 - FARTHEST_M / distance) * offset
    return moved
