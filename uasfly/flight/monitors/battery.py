"""Is there enough in the battery to fly on, and to come home?"""

from __future__ import annotations

import math
from collections import deque

from uasfly.airframe import Airframe
from uasfly.flight.monitors.watched import Watched
from uasfly.mission import Mission
from uasfly.monitor_settings import BatteryMonitor

RATE_WINDOW_S = 60.0
SHORTEST_S = 20.0  # of history, before a rate is believed
LANDING_S = 10.0  # beside the way down
LARGEST_STEP = 0.03  # of the charge, between two samples


class BatteryLow:
    """Charge below what is to be told."""

    def __init__(self, settings: BatteryMonitor) -> None:
        """Take the threshold."""
        self._remaining = settings.warn_remaining

    def __call__(self, watched: Watched) -> str:
        """What is left."""
        battery = watched.view.battery
        if battery is None or not battery.remaining < self._remaining:  # False for unknown
            return ""
        return f"battery at {battery.remaining * 100.0:.0f} %"


class BatteryEnds:
    """Charge or voltage too low to fly on, or just enough to fly home and land."""

    def __init__(self, settings: BatteryMonitor, mission: Mission, airframe: Airframe) -> None:
        """Take thresholds and speeds."""
        self._settings = settings
        self._speed_m_s = min(mission.transition.speed_m_s, airframe.limits.speed_m_s)
        self._descent_m_s = airframe.limits.descent_m_s
        self._charges: deque[tuple[float, float]] = deque()

    def __call__(self, watched: Watched) -> str:
        """What is left, and what that is enough for."""
        battery, settings = watched.view.battery, self._settings
        if battery is None:
            return ""
        if settings.voltage_v is not None and battery.voltage_v < settings.voltage_v:
            return f"battery at {battery.voltage_v:.1f} V"
        if not math.isfinite(battery.remaining):
            return ""
        if battery.remaining < settings.remaining:
            return f"battery at {battery.remaining * 100.0:.0f} %"
        left = battery.remaining - self._rate(battery.time_s, battery.remaining) * self._time_home_s(watched)
        if left < settings.reserve:
            return (
                f"battery at {battery.remaining * 100.0:.0f} %: {max(0.0, left) * 100.0:.0f} % left on arrival at home"
            )
        return ""

    def _rate(self, time_s: float, remaining: float) -> float:
        """Share of the charge used a second, over the last minute."""
        charges = self._charges
        if charges and abs(remaining - charges[-1][1]) > LARGEST_STEP:
            charges.clear()  # the battery was judged anew, not emptied
        if not charges or time_s > charges[-1][0]:
            charges.append((time_s, remaining))
        while charges[0][0] < time_s - RATE_WINDOW_S:
            charges.popleft()
        span = time_s - charges[0][0]
        used: float = charges[0][1] - remaining
        return max(0.0, used / span) if span >= SHORTEST_S else 0.0

    def _time_home_s(self, watched: Watched) -> float:
        x, y, z = (watched.home - watched.estimate.position_in_world).tolist()
        down = max(0.0, -float(z))
        return math.hypot(x, y) / self._speed_m_s + down / self._descent_m_s + LANDING_S
