"""RMS errors of a flight: truth, estimate, reference and GNSS, each compared at the time that it was true.

Kept as they come and compared some at a time: in a control cycle nothing is searched or interpolated.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from uasfly.message_class import message
from uasfly.messages import Array, OdometrySample, TruthSample

EVERY_CYCLES = 32  # what has come since then is compared together: 0.13 ms, not 27 us in every cycle
KEPT = 512  # of each kind, seconds: as late truth and GNSS may come
MOST = 2048  # while there is nothing to compare with


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


@message
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
    _cycles: list[_Cycle] = field(default_factory=list)  # kept a while: truth and GNSS come late
    _truths: list[TruthSample] = field(default_factory=list)  # likewise, for GNSS
    _new_truths: list[TruthSample] = field(default_factory=list)  # not yet compared
    _new_fixes: list[OdometrySample] = field(default_factory=list)
    _new_cycles: int = 0

    def hear(self, sample: TruthSample | OdometrySample) -> None:
        """Where the vehicle truly is, or where PX4 has it."""
        if isinstance(sample, TruthSample):
            self._truths.append(sample)
            self._new_truths.append(sample)
        else:
            self._new_fixes.append(sample)
        if len(self._new_fixes) + len(self._truths) > MOST:  # no legs are flown
            self.compare()

    def cycle(self, time_s: float, estimate: Array, reference: Array, datum: MarkerDatum | None) -> None:
        """One step of the legs: estimate and reference (3,) [m, world]."""
        self._cycles.append(_Cycle(time_s, estimate, reference, datum))
        self._new_cycles += 1
        if self._new_cycles >= EVERY_CYCLES:
            self.compare()

    def compare(self) -> None:
        """Compare what can be compared by now; the rest waits for what lies on its other side."""
        new = self._cycles[len(self._cycles) - self._new_cycles :]
        self._new_cycles = 0
        if new:
            self.against_estimate.add(np.array([cycle.estimate - cycle.reference for cycle in new]))
        self._truths.sort(key=_time)
        cycles, truths = self._cycles, self._truths
        if len(cycles) > 1 and len(truths) > 1:
            begin_s, end_s = cycles[0].time_s, cycles[-1].time_s
            due, self._new_truths = _due(self._new_truths, begin_s, end_s)
            if due:
                self._compare_truth(due)
            fixes, self._new_fixes = _due(
                self._new_fixes, max(begin_s, truths[0].time_s), min(end_s, truths[-1].time_s)
            )
            if fixes:
                self._compare_gnss(fixes)
        for kept in (self._cycles, self._truths, self._new_truths, self._new_fixes):
            del kept[:-KEPT]

    def _compare_truth(self, truths: list[TruthSample]) -> None:
        asked = np.array([truth.time_s for truth in truths])
        true = np.array([truth.position_in_world for truth in truths])
        cycles = _around(self._cycles, asked)
        times = np.array([cycle.time_s for cycle in cycles])
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

    def _compare_gnss(self, fixes: list[OdometrySample]) -> None:
        asked = np.array([fix.time_s for fix in fixes])
        truths = _around(self._truths, asked)
        times = np.array([truth.time_s for truth in truths])
        true = np.array([truth.position_in_world for truth in truths])
        self.gnss.add(np.array([fix.position_in_world for fix in fixes]) - _interpolated(asked, times, true))


class _Timed(Protocol):
    @property
    def time_s(self) -> float: ...


_Item = TypeVar("_Item", bound=_Timed)


def _time(item: _Timed) -> float:
    return item.time_s


def _due(items: list[_Item], begin_s: float, end_s: float) -> tuple[list[_Item], list[_Item]]:
    """Those within the times, and those after them; what is before, or has no time, is dropped."""
    return [item for item in items if begin_s <= item.time_s <= end_s], [item for item in items if item.time_s > end_s]


def _around(items: list[_Item], asked: Array) -> list[_Item]:
    """The part of the items, which are in order, that lies around the asked times."""
    first = bisect.bisect_right(items, asked.min(), key=_time)
    last = bisect.bisect_left(items, asked.max(), key=_time)
    return items[max(0, first - 1) : last + 1]


def _interpolated(asked: Array, times: Array, values: Array) -> Array:
    """Values (n, 3) at the asked times, linear between the times around each."""
    return np.column_stack([np.interp(asked, times, axis) for axis in values.T])
