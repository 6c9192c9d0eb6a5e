"""A motion given segment by segment: a row of numbers each, and one generated function that knows the formula."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from uasfly import native
from uasfly.messages import Array

CHUNK = 256  # times sampled at once

Formula = Callable[[ca.SX, ca.SX], list[ca.SX]]  # (time since the segment's start [s], its row) -> results


def segment_function(name: str, size: int, formula: Formula) -> ca.Function:
    """(time [s], start [s], duration [s] and row (2 + size,)) -> results, the time clamped to the segment; compiled."""
    time, since, row = ca.SX.sym("time"), ca.SX.sym("since"), ca.SX.sym("row", 2 + size)
    clamped = ca.fmin(ca.fmax(time - row[0], 0.0), row[1])
    results = ca.substitute(formula(since, row[2:]), [since], [clamped])
    function = ca.Function(name, [time, row], [ca.densify(result) for result in results], {"cse": True})
    return native.compiled([function], name)[0]


class Segments:
    """Samples segments that follow one another; before the first and after the last their ends hold. For one thread.

    Args:
        function: see `segment_function`; all its results have the same length w, there are r of them.
        durations_s: (m,).
        rows: (m, size) of the formula.
    """

    def __init__(self, function: ca.Function, durations_s: Array, rows: Array) -> None:
        ends = np.cumsum(durations_s)
        starts = np.concatenate(([0.0], ends[:-1]))
        self.duration_s = float(ends[-1]) if ends.size else 0.0
        self._function = function
        self._joints = ends[:-1].copy()
        self._rows = np.column_stack((starts[: len(rows)], durations_s, rows))
        self._samplers: dict[int, _Sampler] = {}  # by the number of times
        self._one = _Sampler(function, 1)

    def sample(self, times_s: Array) -> Array:
        """Results (r, n, w) at (n,) times [s]."""
        count = times_s.size
        sampler = self._samplers.get(count)
        if sampler is None:
            if not 0 < count <= CHUNK:
                return self._sample_in_chunks(times_s)
            sampler = self._samplers[count] = _Sampler(self._function, count)
        index = self._joints.searchsorted(times_s, "right")
        self._rows.take(index, axis=0, out=sampler.rows, mode="clip")  # nothing is clipped: this mode needs no copy
        sampler.times_s[:] = times_s
        sampler.evaluate()
        return sampler.results.copy()

    def sample_one(self, time_s: float) -> Array:
        """Results (r, w) at one time [s]; overwritten by the next call."""
        sampler = self._one
        sampler.times_s[0], sampler.rows[0] = time_s, self._rows[bisect_right(self._joints, time_s)]
        sampler.evaluate()
        return sampler.one

    def _sample_in_chunks(self, times_s: Array) -> Array:
        parts = [self.sample(times_s[first : first + CHUNK]) for first in range(0, times_s.size, CHUNK)]
        return np.concatenate(parts, axis=1) if parts else self._one.results[:, :0].copy()


class _Sampler:
    """The function on memory that stays: fill `times_s` and `rows`, call `evaluate`, read `results`."""

    def __init__(self, function: ca.Function, count: int) -> None:
        self.times_s, self.rows = np.empty(count), np.empty((count, function.numel_in(1)))
        self.results = np.empty((function.n_out(), count, function.numel_out(0)))
        self.one = self.results[:, 0]
        self._buffer: Any
        self._buffer, self.evaluate = function.map(count).buffer()
        for index, argument in enumerate((self.times_s, self.rows)):
            self._buffer.set_arg(index, argument.data)
        for index, result in enumerate(self.results):
            self._buffer.set_res(index, result.data)
