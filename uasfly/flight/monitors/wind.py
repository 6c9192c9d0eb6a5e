"""Can the vehicle hold against this wind, and fly home in it?"""

from __future__ import annotations

import math

from uasfly.airframe import Airframe
from uasfly.flight.monitors.watched import Watched
from uasfly.mission import Mission
from uasfly.monitor_settings import WindMonitor

LONGEST_STEP_S = 0.1  # after a pause one sample is no mean
STEADY_S = 10.0  # time constant of the mean that a limit in m/s is held against


class WindTakesMuch:
    """The share of the authority that is to be told."""

    def __init__(self, settings: WindMonitor) -> None:
        """Take the threshold."""
        self._share = settings.warn_share

    def __call__(self, watched: Watched) -> str:
        """How much."""
        expected = watched.authority.peak
        return f"wind takes {expected * 100.0:.0f} % of tilt and thrust" if expected > self._share else ""


class CannotReturn:
    """More than there is, on the way home."""

    def __init__(self, settings: WindMonitor) -> None:
        """Take the threshold."""
        self._share = settings.share

    def __call__(self, watched: Watched) -> str:
        """What it would take."""
        needed = watched.authority.homeward
        if not needed > self._share:
            return ""
        return f"cannot return: flying home takes {needed * 100.0:.0f} % of tilt and thrust"


class CannotHold:
    """More than there is, soon."""

    def __init__(self, settings: WindMonitor) -> None:
        """Take the threshold."""
        self._share = settings.share

    def __call__(self, watched: Watched) -> str:
        """What it takes."""
        expected = watched.authority.peak
        return f"cannot hold: wind takes {expected * 100.0:.0f} % of tilt and thrust" if expected > self._share else ""


class BeyondWindLimit:
    """Steady wind above the limit of the mission, or of the airframe, in m/s from force over drag."""

    def __init__(self, mission: Mission, airframe: Airframe) -> None:
        """Take the limit."""
        self._limit_m_s = mission.limits.wind_m_s or airframe.limits.wind_m_s
        self._drag_1_s = max(airframe.model.drag_1_s[:2])
        self._mean = [0.0, 0.0]
        self._time_s: float | None = None

    def __call__(self, watched: Watched) -> str:
        """How strong it is."""
        east, north, _ = watched.estimate.force_in_world.tolist()
        elapsed = 0.0 if self._time_s is None else min(watched.time_s - self._time_s, LONGEST_STEP_S)
        self._time_s = watched.time_s
        if not math.isfinite(east + north) or self._drag_1_s <= 0.0:
            return ""
        weight = 1.0 - math.exp(-elapsed / STEADY_S)
        self._mean = [self._mean[0] + weight * (east - self._mean[0]), self._mean[1] + weight * (north - self._mean[1])]
        speed = math.hypot(*self._mean) / self._drag_1_s
        return f"steady wind of {speed:.0f} m/s, the limit is {self._limit_m_s:g}" if speed > self._limit_m_s else ""
