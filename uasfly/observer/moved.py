"""Markers that have been moved: sightings that all say the same other place are no outliers."""

from __future__ import annotations

from uasfly.observer.moment import Verdict

MOVED_AFTER, MOVED_M = 5, 0.15  # so many sightings refused in a row, that far away: the marker has been moved


class MoveWatch:
    """Looks at what the gate says of each sighting."""

    def __init__(self) -> None:
        self._moved: list[tuple[int, float]] = []
        self._refused: dict[int, int] = {}

    def look(self, marker_id: int, verdict: Verdict) -> bool:
        """Whether the marker has been moved, by this sighting's verdict and those before."""
        refused = 0 if verdict.accepted or verdict.away_m < MOVED_M else self._refused.get(marker_id, 0) + 1
        moved = refused >= MOVED_AFTER
        self._refused[marker_id] = 0 if moved else refused
        if moved:
            self._moved.append((marker_id, verdict.away_m))
        return moved

    def take(self) -> list[tuple[int, float]]:
        """Markers that have been moved since the last call, and how far [m] each was away from its place."""
        moved, self._moved = self._moved, []
        return moved
