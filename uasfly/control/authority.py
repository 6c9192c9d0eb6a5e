"""What the vehicle can hold, and what the controller may therefore plan against.

A force beyond the limits of tilt and thrust, or a reference far away, makes the plan's cost enormous and its optimum a
corner of every bound; one Newton step a sample then jumps from corner to corner. Planning against the strongest force
that can be held, towards a point that is near, gives the same saturated tilt without the jumps, and keeps the height.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Limits, ModelParameters
from uasfly.messages import Array, Authority

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


FAST_S = 0.5  # means of the force: what is now,
SLOW_S = 2.0  # and what was a little before, so that their difference is a trend
AHEAD_S = 0.5  # the trend is believed for so long
NEAR_HOME_M = 2.0


class AuthorityMeter:
    """How much of tilt and thrust the wind takes, now and soon, and how much flying home would.

    Args:
        limits: tilt and thrust.
        model: drag: air that is flown through pushes back.
        home_speed_m_s: speed of the way home.
    """

    def __init__(self, limits: Limits, model: ModelParameters, home_speed_m_s: float) -> None:
        self._tilt_tangent = math.tan(limits.tilt_rad)
        self._thrust_min, self._thrust_max = limits.thrust_min, limits.thrust_max
        self._drag_1_s = max(model.drag_1_s[:2])
        self._home_speed_m_s = home_speed_m_s
        self._fast = self._slow = (0.0, 0.0, 0.0)
        self._time_s: float | None = None

    def update(self, time_s: float, force_in_world: Array, k_thrust_m_s2: float, way_home: Array) -> Authority:
        """Authority at `time_s`; a force that is not finite is not taken in.

        Args:
            time_s: now; must not fall.
            force_in_world: (3,) [m/s^2], the vehicle at rest.
            k_thrust_m_s2: thrust acceleration at full command.
            way_home: (3,) [m], from here to home.
        """
        force = tuple(force_in_world.tolist())
        if not math.isfinite(sum(force)):
            force = self._fast
        if self._time_s is None:
            self._fast = self._slow = force
        elapsed = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        self._fast = _towards(self._fast, force, 1.0 - math.exp(-elapsed / FAST_S))
        self._slow = _towards(self._slow, force, 1.0 - math.exp(-elapsed / SLOW_S))
        horizontal, vertical = self._shares(force, k_thrust_m_s2)
        expected = max(self._shares(self._fast, k_thrust_m_s2))
        before = max(self._shares(self._slow, k_thrust_m_s2))
        trend = (expected - before) / (SLOW_S - FAST_S)
        peak = expected + AHEAD_S * max(0.0, trend)
        return Authority(horizontal, vertical, peak, self._homeward(k_thrust_m_s2, way_home))

    def _shares(self, force: Force, k_thrust_m_s2: float) -> tuple[float, float]:
        """Shares of the tilt and of the thrust that balancing a force takes."""
        east, north, up = force
        lift = max(GRAVITY_M_S2 - up, 1e-3)  # what the rotors have to carry
        sideways = math.hypot(east, north)
        horizontal = sideways / (lift * self._tilt_tangent)
        hover = GRAVITY_M_S2 / k_thrust_m_s2
        thrust = math.hypot(lift, sideways) / k_thrust_m_s2
        if thrust > hover:
            return horizontal, (thrust - hover) / max(self._thrust_max - hover, 1e-3)
        return horizontal, (hover - thrust) / max(hover - self._thrust_min, 1e-3)

    def _homeward(self, k_thrust_m_s2: float, way_home: Array) -> float:
        x, y, _ = way_home.tolist()
        distance = math.hypot(x, y)
        east, north, up = self._slow
        if distance > NEAR_HOME_M:
            push = self._drag_1_s * self._home_speed_m_s / distance
            east, north = east - push * x, north - push * y
        return max(self._shares((east, north, up), k_thrust_m_s2))


Force = tuple[float, float, float]


def _towards(old: Force, new: Force, weight: float) -> Force:
    (a, b, c), (x, y, z) = old, new
    return a + weight * (x - a), b + weight * (y - b), c + weight * (z - c)
