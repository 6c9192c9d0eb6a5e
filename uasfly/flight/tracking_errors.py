"""RMS errors of a flight: truth, estimate, reference and GNSS, each compared at the time that it was true.

Kept as they come and compared some hundred at a time: in a control cycle nothing is searched or interpolated.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from uasfly.messages import Array, OdometrySample, TruthSample

EVERY_CYCLES = 256  # what has come since then is compared together
MOST = 2048  # samples kept while there is nothing to compare them with


@dataclass(frozen=True, slots=True)
class MarkerDatum:
    """Where a marker is as the filter has it and in truth: what a flight by that marker is measured against.

    Attributes:
        estimated_position, true_position: (3,) m, world.
        turn_rad: about the vertical, from the true to the estimated.
    """

    estimated_position: Array
    true_position: Array
    turn_rad: float

    def placed(self, position: Array) -> Array:
        """A true position (3,) [m, world] as it lies in the filter's world: the same as seen from the marker."""
        x, y, z = (position - self.true_position).tolist()
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        placed: Array = self.estimated_position + np.array((c * x - s * y, s * x + c * y, z))
        return placed


@dataclass(slots=True)
class SquareSum:
    """Running RMS per axis and largest norm."""

    count: int = 0
    squares: Array = field(default_factory=lambda: np.zeros(3))
    largest: float = 0.0

    def add(self, errors: Array) -> None:
        """Take in errors (n, 3); those that are not finite say nothing."""
        squares = errors[np.isfinite(errors).all(axis=1)] ** 2
        if len(squares):
            self.count += len(squares)
            self.squares += squares.sum(axis=0)
            self.largest = max(self.largest, math.sqrt(squares.sum(axis=1).max()))

    def rms(self) -> dict[str, float] | None:
        """RMS by axis and in total; None where nothing was taken in."""
        if self.count == 0:
            return None
        x, y, z = np.sqrt(self.squares / self.count).tolist()
        return {"x": x, "y": y, "z": z, "total": math.sqrt(self.squares.sum() / self.count)}


@dataclass(frozen=True, slots=True)
class _Cycle:
    time_s: float
    estimate: Array
    reference: Array
    datum: MarkerDatum | None


@dataclass(slots=True)
class TrackingErrors:
    """Collects positions while the legs fly.

    Truth and GNSS arrive later than they were true, so both are compared where cycles, and truth, lie on both sides.

    Attributes:
        against_truth, against_estimate: position minus reference. estimate: minus truth. gnss: minus truth.
        by_marker, estimate_by_marker: `against_truth` and `estimate` as seen from the marker.
    """

    against_truth: SquareSum = field(default_factory=SquareSum)
    against_estimate: SquareSum = field(default_factory=SquareSum)
    estimate: SquareSum = field(default_factory=SquareSum)
    gnss: SquareSum = field(default_factory=SquareSum)
    by_marker: SquareSum = field(default_factory=SquareSum)
    estimate_by_marker: SquareSum = field(default_factory=SquareSum)
    _cycles: list[_Cycle] = field(default_factory=list)
    _truths: list[TruthSample] = field(default_factory=list)
    _fixes: list[OdometrySample] = field(default_factory=list)
    _new: int = 0  # cycles that have come since the last comparison
    _compared_s: float = -math.inf

    def hear(self, sample: TruthSample | OdometrySample) -> None:
        """Where the vehicle truly is, or where PX4 has it."""
        if isinstance(sample, TruthSample):
            self._truths.append(sample)
        else:
            self._fixes.append(sample)
        if len(self._fixes) + len(self._truths) > MOST:  # no legs are flown
            self.compare()

    def cycle(self, time_s: float, estimate: Array, reference: Array, datum: MarkerDatum | None) -> None:
        """One step of the legs: estimate and reference (3,) [m, world]."""
        self._cycles.append(_Cycle(time_s, estimate, reference, datum))
        self._new += 1
        if self._new >= EVERY_CYCLES:
            self.compare()

    def compare(self) -> None:
        """Compare what can be compared by now; it is not kept any longer than that takes."""
        new = self._cycles[len(self._cycles) - self._new :]
        self._new = 0
        if new:
            self.against_estimate.add(np.array([cycle.estimate - cycle.reference for cycle in new]))
        self._truths.sort(key=_time)
        if len(self._cycles) > 1 and len(self._truths) > 1:
            until_s = min(self._cycles[-1].time_s, self._truths[-1].time_s)
            self._compare_truth(until_s)
            self._compare_gnss(until_s)
            self._compared_s = until_s
        self._cycles = _still_needed(self._cycles, self._compared_s)
        self._truths = _still_needed(self._truths, self._compared_s)
        self._fixes = [fix for fix in self._fixes if fix.time_s > self._compared_s][-MOST // 4 :]

    def _compare_truth(self, until_s: float) -> None:
        cycles = self._cycles
        times = np.array([cycle.time_s for cycle in cycles])
        begin_s = max(self._compared_s, math.nextafter(cycles[0].time_s, -math.inf))
        truths = [truth for truth in self._truths if begin_s < truth.time_s <= until_s]
        if not truths:
            return
        asked = np.array([truth.time_s for truth in truths])
        true = np.array([truth.position_in_world for truth in truths])
        estimate = _interpolated(asked, times, np.array([cycle.estimate for cycle in cycles]))
        reference = _interpolated(asked, times, np.array([cycle.reference for cycle in cycles]))
        self.against_truth.add(true - reference)
        self.estimate.add(estimate - true)
        before = [cycles[k - 1].datum for k in np.searchsorted(times, asked, side="right").tolist()]
        seen = [k for k, datum in enumerate(before) if datum is not None]
        if seen:
            placed = np.array([datum.placed(true[k]) for k, datum in enumerate(before) if datum is not None])
            self.by_marker.add(placed - reference[seen])
            self.estimate_by_marker.add(estimate[seen] - placed)

    def _compare_gnss(self, until_s: float) -> None:
        begin_s = max(self._compared_s, math.nextafter(self._cycles[0].time_s, -math.inf), self._truths[0].time_s)
        fixes = [fix for fix in self._fixes if begin_s < fix.time_s <= until_s]
        if fixes:
            times = np.array([truth.time_s for truth in self._truths])
            true = np.array([truth.position_in_world for truth in self._truths])
            asked = np.array([fix.time_s for fix in fixes])
            self.gnss.add(np.array([fix.position_in_world for fix in fixes]) - _interpolated(asked, times, true))


class _Timed(Protocol):
    @property
    def time_s(self) -> float: ...


_Item = TypeVar("_Item", bound=_Timed)


def _time(item: _Timed) -> float:
    return item.time_s


def _still_needed(items: list[_Item], compared_s: float) -> list[_Item]:
    """From the last one not after `compared_s` on, and no more than MOST / 4."""
    first = max(0, bisect.bisect_right(items, compared_s, key=_time) - 1)
    return items[max(first, len(items) - MOST // 4) :]


def _interpolated(asked: Array, times: Array, values: Array) -> Array:
    """Values (n, 3) at the asked times, linear between the times around each."""
    return np.column_stack([np.interp(asked, times, axis) for axis in values.T])
