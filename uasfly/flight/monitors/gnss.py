"""Is GNSS there, good, and where it was?"""

from __future__ import annotations

from uasfly.flight.monitors.watched import Watched
from uasfly.monitor_settings import GnssDegradedMonitor, GnssDriftMonitor, GnssJumpMonitor

FIX = 3


class GnssLost:
    """No fix although there was one, or PX4 calls its position or velocity invalid."""

    def __init__(self) -> None:
        """Nothing has been heard."""
        self._had_fix = False

    def __call__(self, watched: Watched) -> str:
        """What is lost."""
        health = watched.view.health
        if health is None or not watched.view.in_air:
            return ""
        self._had_fix |= health.gnss_fix >= FIX
        if self._had_fix and health.gnss_fix < FIX:
            return "GNSS is lost"
        if not (health.position_ok and health.velocity_ok):
            return "PX4 calls its position invalid"
        return ""


class GnssDegraded:
    """Poor accuracy or few satellites, where PX4 knows them."""

    def __init__(self, settings: GnssDegradedMonitor) -> None:
        """Take the thresholds."""
        self._settings = settings

    def __call__(self, watched: Watched) -> str:
        """How poor it is."""
        health = watched.view.health
        if health is None or health.gnss_fix < FIX or not watched.view.in_air:
            return ""
        if health.horizontal_accuracy_m > self._settings.accuracy_m:  # False for unknown
            return f"GNSS is accurate to {health.horizontal_accuracy_m:.1f} m only"
        if 0 < health.gnss_satellites < self._settings.satellites:
            return f"GNSS has {health.gnss_satellites} satellites only"
        return ""


class GnssJump:
    """The measured position has jumped against everything else."""

    def __init__(self, settings: GnssJumpMonitor) -> None:
        """Take the thresholds."""
        self._settings = settings

    def __call__(self, watched: Watched) -> str:
        """How far."""
        diagnosis, settings = watched.diagnosis, self._settings
        if diagnosis.jump_m >= settings.jump_m and watched.time_s - diagnosis.jump_s < JUMP_SHOWN_S:
            return f"GNSS has jumped by {diagnosis.jump_m:.1f} m; the position goes on without the jump"
        return ""


class GnssDrift:
    """The measured position runs away from the velocity."""

    def __init__(self, settings: GnssDriftMonitor) -> None:
        """Take the thresholds."""
        self._settings = settings

    def __call__(self, watched: Watched) -> str:
        """How fast."""
        speed = watched.diagnosis.drift_m_s
        return f"GNSS drifts away with {speed:.1f} m/s" if speed > self._settings.rate_m_s else ""


JUMP_SHOWN_S = 0.5
