"""Time stamps that cannot be taken as they are: far ahead of the filter, or all too old for it."""

from __future__ import annotations

JUMP_AHEAD_S = 1.0  # a sample further ahead of the filter than this needs a second one to be believed
RESTART_AFTER_S = 1.0  # samples that are all too old for this long: the clock was set back, start again


class ClockWatch:
    """Tells a wrong time stamp from a clock that was set."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._dropped_from_s: float | None = None

    def believes(self, time_s: float) -> bool:
        """Whether a sample far ahead is believed: one alone is a wrong time stamp, a second soon after confirms it."""
        if self._ahead_s is not None and 0.0 < time_s - self._ahead_s < JUMP_AHEAD_S:
            return True
        self._ahead_s = time_s
        return False

    def was_set_back(self, time_s: float) -> bool:
        """Whether the clock was set back, by one more sample that is too old: nothing else has come for a while."""
        if self._dropped_from_s is None or time_s < self._dropped_from_s:
            self._dropped_from_s = time_s
        return time_s - self._dropped_from_s > RESTART_AFTER_S

    def not_ahead(self) -> None:
        """A sample has come that is not far ahead, or is believed."""
        self._ahead_s = None

    def in_order(self) -> None:
        """A sample has come that the filter takes."""
        self._ahead_s = self._dropped_from_s = None
