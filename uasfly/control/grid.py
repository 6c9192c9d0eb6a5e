"""The time grid of the optimal control problem: dense near the start, wide at the end, moved along by the clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from uasfly.messages import Array


def geometric_intervals(horizon_s: float, nodes: int, first_interval_s: float) -> Array:
    """Lengths (nodes,) [s] that start at `first_interval_s`, grow by a constant ratio and add up to `horizon_s`.

    Raises:
        ValueError: when the intervals would have to shrink: first_interval_s * nodes > horizon_s.
    """
    if nodes < 1 or not 0.0 < first_interval_s * nodes <= horizon_s * (1.0 + 1e-9):
        raise ValueError(
            "the grid needs 0 < first_interval_s * nodes <= horizon_s, "
            f"found {first_interval_s} * {nodes} and {horizon_s}"
        )
    if nodes == 1 or first_interval_s * nodes >= horizon_s * (1.0 - 1e-9):
        return np.full(nodes, horizon_s / nodes)
    exponents = np.arange(nodes)

    def excess(ratio: float) -> float:
        return first_interval_s * float(np.sum(ratio**exponents)) - horizon_s

    largest = (horizon_s / first_interval_s) ** (1.0 / (nodes - 1))  # the last interval alone fills the horizon
    ratio = brentq(excess, 1.0, largest, xtol=1e-14)
    intervals = first_interval_s * ratio**exponents
    intervals[-1] += horizon_s - float(np.sum(intervals))
    return np.asarray(intervals, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Grid:
    """Node times of a plan, relative to its start.

    Attributes:
        interval_s: (N,) lengths. time_s: (N + 1,) node times, the first 0.
    """

    interval_s: Array
    time_s: Array

    @classmethod
    def from_intervals(cls, interval_s: Array) -> Grid:
        """Grid of the given interval lengths (N,) [s]."""
        interval = np.ascontiguousarray(interval_s, dtype=np.float64)
        if interval.ndim != 1 or not np.all(interval > 0.0):
            raise ValueError(f"interval lengths must be positive, found {interval_s}")
        return cls(interval, np.concatenate(((0.0,), np.cumsum(interval))))

    @property
    def nodes(self) -> int:
        """Number of intervals N."""
        return self.interval_s.size

    def interval_at(self, time_s: float) -> int:
        """Index of the interval that holds a time since the plan's start [s]; the ends of the grid hold beyond it."""
        index = int(np.searchsorted(self.time_s, time_s, side="right")) - 1
        return min(max(index, 0), self.nodes - 1)


@dataclass(frozen=True, slots=True)
class Shift:
    """How a plan looks from a later start on the same grid; beyond its end the plan holds its last values.

    States are interpolated linearly between nodes. An input is the mean of the old, piecewise constant inputs over the
    new interval, which keeps their impulse. A bound is active where it was in the middle of the new interval.

    Attributes:
        node: (N + 1,) old interval that holds each new node; fraction: (N + 1, 1) place in it, 0..1.
        mean: (N, N) weights of the old inputs in the new ones, rows add up to 1.
        nearest: (N,) old interval under the middle of each new one.
    """

    node: NDArray[np.intp]
    fraction: Array
    mean: Array
    nearest: NDArray[np.intp]

    @classmethod
    def after(cls, grid: Grid, elapsed_s: float) -> Shift:
        """Shift by `elapsed_s` >= 0."""
        time, interval, last = grid.time_s, grid.interval_s, grid.nodes - 1
        moved = np.minimum(time + elapsed_s, time[-1])
        node = np.clip(np.searchsorted(time, moved, side="right") - 1, 0, last)
        fraction = (moved - time[node]) / interval[node]
        start, end = moved[:-1, None], moved[1:, None]
        overlap = np.clip(np.minimum(end, time[1:]) - np.maximum(start, time[:-1]), 0.0, None)
        covered = overlap.sum(axis=1, keepdims=True)
        at_end = np.zeros_like(overlap)
        at_end[:, last] = 1.0
        mean = np.where(covered > 1e-12, overlap / np.maximum(covered, 1e-12), at_end)
        middle = 0.5 * (moved[:-1] + moved[1:])
        nearest = np.clip(np.searchsorted(time, middle, side="right") - 1, 0, last)
        return cls(node, fraction[:, None], mean, nearest)

    def states(self, states: Array, out: Array | None = None) -> Array:
        """States (N + 1, n) at the new nodes, into `out` where there is one."""
        at, following = states.take(self.node, axis=0), states.take(self.node + 1, axis=0)
        following -= at
        following *= self.fraction
        return np.asarray(np.add(at, following, out=out))

    def inputs(self, inputs: Array, out: Array | None = None) -> Array:
        """Inputs (N, m) over the new intervals, into `out` where there is one."""
        return np.asarray(np.dot(self.mean, inputs, out=out))
