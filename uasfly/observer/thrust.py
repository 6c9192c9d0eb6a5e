"""Which thrust acts when: the commands that were really sent, delayed, as a piecewise-constant history."""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort

_KEPT_S = 3.0  # s, more than the filter ever goes back
_PRUNE_AT = 512  # entries


class ThrustHistory:
    """Thrust acceleration along the body z axis [m/s^2] over time, each command acting `delay_s` after its own time.

    Args:
        delay_s: dead time from command to response.
        default_m_s2: what is assumed to act before the first command.
    """

    def __init__(self, delay_s: float, default_m_s2: float) -> None:
        self._delay_s = delay_s
        self._default = default_m_s2
        self._scale = 1.0
        self._entries: list[tuple[float, float]] = []  # time at which it begins to act, acceleration

    def add(self, time_s: float, acceleration_m_s2: float) -> None:
        """A command of `acceleration_m_s2` left at `time_s`; commands may come in any order."""
        entries = self._entries
        entry = (time_s + self._delay_s, acceleration_m_s2 / self._scale)
        if not entries or entry[0] > entries[-1][0]:
            entries.append(entry)
        else:
            insort(entries, entry)
        if len(entries) > _PRUNE_AT:
            keep_from = bisect_right(entries, (entries[-1][0] - _KEPT_S, float("inf"))) - 1
            del entries[: max(keep_from, 0)]

    def rescale(self, ratio: float) -> None:
        """All commands so far give `ratio` times what they were added with; what is assumed before them does not."""
        self._scale *= ratio
        self._default /= ratio

    @property
    def newest_m_s2(self) -> float:
        """What the newest command gives, once it acts."""
        return (self._entries[-1][1] if self._entries else self._default) * self._scale

    def mean(self, start_s: float, end_s: float) -> float:
        """Mean acceleration [m/s^2] over [start_s, end_s]; where that is empty, what acts just before `end_s`."""
        entries = self._entries
        index = bisect_left(entries, (end_s,)) - 1
        total, upper = 0.0, end_s
        while index >= 0 and entries[index][0] > start_s:
            begin, value = entries[index]
            total += value * (upper - begin)
            upper = begin
            index -= 1
        value = entries[index][1] if index >= 0 else self._default
        if upper == end_s:
            return value * self._scale
        return self._scale * (total + value * (upper - start_s)) / (end_s - start_s)
