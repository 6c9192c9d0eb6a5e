"""The recent past of the filter: where a measurement that comes late is put in, and the filter run again from there."""

from __future__ import annotations

from bisect import bisect_right

from uasfly.messages import Array
from uasfly.observer import states as s
from uasfly.observer.door import Measurement, Sighting
from uasfly.observer.moment import Moment, Verdict
from uasfly.observer.step import Stepper

BUFFER_S = 0.6  # how far back a measurement can be put in
_SAME_TIME_S = 1e-6


class Timeline:
    """The moments of the last BUFFER_S, oldest first; there is always at least one.

    Args:
        stepper: the filter's steps.
        first: the first moment.
    """

    def __init__(self, stepper: Stepper, first: Moment) -> None:
        self._stepper = stepper
        self._moments = [first]

    @property
    def oldest(self) -> Moment:
        """The moment before which nothing can be put in."""
        return self._moments[0]

    @property
    def newest(self) -> Moment:
        """The moment where the filter stands."""
        return self._moments[-1]

    def at(self, time_s: float) -> Moment:
        """The last moment not after `time_s`; the oldest where all are."""
        return self._moments[max(self._index_at(time_s), 0)]

    def holds(self, measured: Measurement) -> bool:
        """Whether there is already a measurement of the same sensor (the same marker) at the same time."""
        index = self._index_at(measured.time_s + _SAME_TIME_S)
        while index >= 0 and measured.time_s - self._moments[index].time_s <= _SAME_TIME_S:
            if _same_source(self._moments[index].measured, measured):
                return True
            index -= 1
        return False

    def append(self, time_s: float, measured: Measurement | None, airborne: bool) -> tuple[Verdict, ...]:
        """Go on to `time_s`, not before the newest moment, and forget what is older than BUFFER_S."""
        moment, verdicts = self._stepper.advance(self.newest, time_s, measured, airborne)
        self._moments.append(moment)
        while self._moments[1].time_s < time_s - BUFFER_S:
            del self._moments[0]
        return verdicts

    def insert(self, measured: Measurement) -> tuple[Verdict, ...]:
        """Put a measurement in between, not before the oldest moment, and run the filter again from there.

        The cost is bounded by the measurements of BUFFER_S.
        """
        index = self._index_at(measured.time_s) + 1
        later = self._moments[index:]
        del self._moments[index:]
        moment, verdicts = self._stepper.advance(self.newest, measured.time_s, measured, self.newest.airborne)
        self._moments.append(moment)
        for old in later:
            moment, _ = self._stepper.advance(moment, old.time_s, old.measured, old.airborne)
            self._moments.append(moment)
        return verdicts

    def shift_force(self, change: Array) -> None:
        """Add `change` (3,) [m/s^2, world] to the force at every moment of flight; all else stays."""
        shifted = None
        for moment in self._moments:
            if moment.airborne and moment.packed is not shifted:  # moments of the same time may share it
                moment.packed[s.FORCE] += change
            shifted = moment.packed

    def forget(self, marker_id: int) -> None:
        """Take a marker out of every moment, and its sightings with it."""
        self._moments = [moment.without(marker_id) for moment in self._moments]

    def _index_at(self, time_s: float) -> int:
        if self._moments[-1].time_s <= time_s:
            return len(self._moments) - 1
        return bisect_right(self._moments, time_s, key=lambda moment: moment.time_s) - 1


def _same_source(one: Measurement | None, other: Measurement) -> bool:
    if isinstance(one, Sighting) and isinstance(other, Sighting):
        return one.marker_id == other.marker_id
    return type(one) is type(other)
