"""Watches the flight against the mission's limits: geofence and altitude; a breach ends the mission."""

from __future__ import annotations

import math

from uasfly.messages import Array, StateEstimate
from uasfly.mission import MissionLimits

BREACH_TIME_S = 0.5  # a breach counts when it lasts
MARGIN_M = 0.5  # the limits bound the reference; the vehicle itself may stray this far beyond them


class Monitors:
    """Limits of one mission, looked at once a cycle while the legs fly."""

    def __init__(self, limits: MissionLimits) -> None:
        """Take the mission's limits."""
        self._limits = limits
        self._since_s: float | None = None

    def check(self, time_s: float, estimate: StateEstimate, origin: Array) -> str:
        """What is breached, "" while nothing is.

        Args:
            time_s: now.
            estimate: the observer's answer for now.
            origin: (3,) the mission's origin in the world [m].
        """
        x, y, z = (estimate.position_in_world - origin).tolist()
        text = ""
        fence = self._limits.geofence
        from_center = 0.0 if fence is None else math.hypot(x - fence.center_m[0], y - fence.center_m[1])
        if fence is not None and not from_center <= fence.radius_m + MARGIN_M:  # also where it is not finite
            text = f"outside the geofence: {from_center:.1f} m from its centre"
        elif not self._limits.altitude_min_m - MARGIN_M <= z <= self._limits.altitude_max_m + MARGIN_M:
            text = f"outside the altitude limits: {z:.1f} m"
        if not text:
            self._since_s = None
            return ""
        if self._since_s is None:
            self._since_s = time_s
        return text if time_s - self._since_s >= BREACH_TIME_S else ""
