"""Does the solver keep up?"""

from __future__ import annotations

from collections import deque

from uasfly.control.protocol import ControlResult
from uasfly.flight.monitors.watched import Watched
from uasfly.monitor_settings import SolverMonitor

FEWEST_STEPS = 10


class Fallbacks:
    """What has flown in the last steps: the solver, its last plan, or the backup."""

    def __init__(self, settings: SolverMonitor) -> None:
        """Take the window."""
        self._settings = settings
        self._steps: deque[tuple[float, str]] = deque()
        self._counts = {"": 0, "plan": 0, "backup": 0}

    def count(self, time_s: float, control: ControlResult | None) -> None:
        """Take in a cycle; the result is None where nothing was controlled."""
        if control is not None:
            self._steps.append((time_s, control.fallback))
            self._counts[control.fallback] += 1
        begin_s = time_s - self._settings.window_s
        while self._steps and self._steps[0][0] < begin_s:
            self._counts[self._steps.popleft()[1]] -= 1

    def late(self, watched: Watched) -> str:
        """Whether too few steps are the solver's own."""
        del watched
        share = self._share(self._counts["plan"] + self._counts["backup"])
        if share > self._settings.late_share:
            return f"the solver is late or fails in {share * 100.0:.0f} % of the steps"
        return ""

    def backup(self, watched: Watched) -> str:
        """Whether the backup flies too much."""
        del watched
        share = self._share(self._counts["backup"])
        if share > self._settings.backup_share:
            return f"the solver fails: the backup flies {share * 100.0:.0f} % of the time"
        return ""

    def _share(self, steps: int) -> float:
        count = len(self._steps)
        return steps / count if count >= FEWEST_STEPS else 0.0
