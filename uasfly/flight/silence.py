"""Silence: telemetry that is too old, a heartbeat that stopped, and a cycle that stood still itself."""

from __future__ import annotations

import math

from uasfly.monitor_settings import TelemetryMonitor

ERROR, WARNING = 3, 4
GRACE_S = 2.0  # after a silence PX4 may be back from its failsafe only after so long


class Silence:
    """Watches ages; times are the flight's.

    Args:
        settings: of the mission file.

    Attributes:
        stale: telemetry is too old to fly by.
        age_s: of the last odometry.
    """

    def __init__(self, settings: TelemetryMonitor) -> None:
        self._settings = settings
        self.stale = False
        self.age_s = math.inf
        self._fresh_s = math.inf  # when telemetry was last fresh
        self._ended_s = -math.inf
        self._last_s: float | None = None
        self._heartbeat_lost = False

    def update(
        self, time_s: float, age_s: float, heartbeat_s: float, streaming: bool
    ) -> tuple[float | None, list[tuple[int, str]]]:
        """One cycle.

        Args:
            time_s: now.
            age_s: of the last odometry.
            heartbeat_s: time of the last heartbeat, NaN before the first.
            streaming: whether setpoints are being sent, which now stop.

        Returns:
            How long a silence that has just ended has lasted [s], else None; and what is to be announced.
        """
        texts: list[tuple[int, str]] = []
        settings, self.age_s = self._settings, age_s
        gap_s = 0.0 if self._last_s is None else time_s - self._last_s
        if gap_s > settings.stale_s:
            texts.append((ERROR, f"the control cycle stood still for {gap_s:.1f} s"))
        lasted: float | None = None
        if age_s <= settings.stale_s:
            if self.stale or gap_s > settings.stale_s:
                lasted = time_s - self._fresh_s
                self._ended_s = time_s
            if self.stale:
                texts.append((WARNING, f"telemetry is back after {lasted:.1f} s"))
            self.stale, self._fresh_s = False, time_s
        elif not self.stale:
            self.stale = True
            stops = ": no setpoints until it is back" if streaming else ""
            texts.append((ERROR, f"telemetry is {age_s:.1f} s old{stops}"))
        self._last_s = time_s
        self._watch_heartbeat(time_s, heartbeat_s, texts)
        return lasted, texts

    def lasts_s(self, time_s: float) -> float:
        """How long the present silence has lasted, 0 where there is none."""
        return time_s - self._fresh_s if self.stale else 0.0

    def just_ended(self, time_s: float) -> bool:
        """Whether PX4 may still be in, or on its way back from, what it does by itself in a silence."""
        return time_s - self._ended_s < GRACE_S

    def _watch_heartbeat(self, time_s: float, heartbeat_s: float, texts: list[tuple[int, str]]) -> None:
        age_s = time_s - heartbeat_s
        if age_s > self._settings.heartbeat_s and not self._heartbeat_lost:
            self._heartbeat_lost = True
            texts.append((ERROR, f"link lost: no heartbeat for {age_s:.0f} s"))
        elif age_s <= self._settings.heartbeat_s and self._heartbeat_lost:
            self._heartbeat_lost = False
            texts.append((WARNING, "link is back"))
