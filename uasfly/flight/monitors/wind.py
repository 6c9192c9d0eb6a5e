"""Can the vehicle hold against this wind, and fly home in it?"""

from __future__ import annotations

from uasfly.airframe import Airframe
from uasfly.flight.monitors.watched import Watched
from uasfly.mission import Mission
from uasfly.monitor_settings import WindMonitor

STEADY_S = 5.0  # of wind at least, for a mean that a limit in m/s is held against


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
    """Mean wind above the limit of the mission, or of the airframe."""

    def __init__(self, mission: Mission, airframe: Airframe) -> None:
        """Take the limit."""
        self._limit_m_s = mission.limits.wind_m_s or airframe.limits.wind_m_s

    def __call__(self, watched: Watched) -> str:
        """How strong it is, once there is a mean of some seconds."""
        wind = watched.wind
        if wind is None or wind.averaged_s < STEADY_S or not wind.mean_speed_m_s > self._limit_m_s:
            return ""
        return f"steady wind of {wind.mean_speed_m_s:.0f} m/s, the limit is {self._limit_m_s:g}"
