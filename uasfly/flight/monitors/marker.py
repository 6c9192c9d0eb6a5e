"""Is the marker that the mission hangs on seen, and where it was?"""

from __future__ import annotations

import math

from uasfly.flight.monitors.watched import Watched
from uasfly.monitor_settings import MarkerLostMonitor, MarkerMovedMonitor

CONTRADICTING = 0.5  # share of the last sightings outside the gate
BACK = 0.5  # of the thresholds: closer again, it is where it was


class MarkerLost:
    """No sighting for a while, in a mission that has begun."""

    def __init__(self, settings: MarkerLostMonitor) -> None:
        """Take the time."""
        self._after_s = settings.after_s
        self._seen_s = -math.inf

    def __call__(self, watched: Watched) -> str:
        """For how long."""
        if watched.marker is not None:
            self._seen_s = watched.marker.seen_s
        age_s = watched.time_s - self._seen_s
        if not watched.by_marker or age_s < self._after_s:
            return ""
        return f"the marker has not been seen for {age_s:.0f} s"


class MarkerMoved:
    """Its sightings contradict the filter, by more than the filter can be wrong."""

    def __init__(self, settings: MarkerMovedMonitor) -> None:
        """Take the thresholds."""
        self._away_m = settings.away_m
        self._turned_rad = math.radians(settings.turned_deg)
        self._moved = False

    def __call__(self, watched: Watched) -> str:
        """How far, or how much it was turned."""
        if watched.marker is None:
            self._moved = False
            return ""
        said = watched.marker.contradiction
        # The matched noise grows with what it cannot explain, until the gate lets it in: after that it must be close.
        share = BACK if self._moved else 1.0
        beyond = said.away_m > share * self._away_m or said.turned_rad > share * self._turned_rad
        self._moved = beyond and (self._moved or said.rejected_share > CONTRADICTING)
        if not self._moved:
            return ""
        turned = math.degrees(said.turned_rad)
        text = f"the marker is seen {said.away_m:.2f} m and {turned:.0f} deg from where it was"
        return f"{text}: it is {'not followed' if watched.by_marker else 'taken anew'}"
