"""Measurements in at their own times: where each belongs, and what the filter and its watches make of it."""

from __future__ import annotations

import math

from uasfly.airframe import Airframe
from uasfly.messages import AccelerometerSample
from uasfly.observer import states as s
from uasfly.observer.accelerometer import BiasWatch
from uasfly.observer.agreement import Agreement
from uasfly.observer.clock_watch import JUMP_AHEAD_S, ClockWatch
from uasfly.observer.counters import Counters
from uasfly.observer.diagnosis import Journal
from uasfly.observer.door import Odometry, Sighting, checked_accelerometer
from uasfly.observer.drive import Drive
from uasfly.observer.glide import Glide
from uasfly.observer.gnss import DriftWatch
from uasfly.observer.moment import Verdict
from uasfly.observer.sightings import SightingLog
from uasfly.observer.step import Stepper
from uasfly.observer.timeline import Timeline

FELT_WITHIN_S = 0.06  # of where the filter stands: an accelerometer's sample further away says nothing
LONGEST_GAP_S = 5.0  # a longer gap is not bridged: the filter starts again
GLIDE_AFTER_S, GLIDE_FOR_S = 1.0, 5.0  # without a sighting for so long, what the next ones correct is told gradually


class Intake:
    """Puts measurements into the filter.

    Args:
        airframe: noise.
        stepper: the filter's steps.
        drive: whether the vehicle flies.
        counters: where is counted what is refused.

    Attributes:
        timeline: the filter's recent past, None before the first odometry sample.
        statistics: of the last innovation, by sensor: normalised square and degrees of freedom.
        bias: of the accelerometer. journal, sightings: what the gates said. drift, agreement: of GNSS and velocity.
        glide: what is told beside the filter's position.
    """

    def __init__(self, airframe: Airframe, stepper: Stepper, drive: Drive, counters: Counters) -> None:
        self._stepper = stepper
        self._drive = drive
        self._counters = counters
        self._feels = airframe.observer.accelerometer_sigma_m_s2 is not None
        self._clock = ClockWatch()
        self._regained_s = -math.inf
        self.timeline: Timeline | None = None
        self.statistics: dict[str, tuple[float, int]] = {}
        self.bias = BiasWatch()
        self.journal = Journal()
        self.sightings = SightingLog()
        self.drift = DriftWatch(airframe.observer.gnss_bias_density)
        self.agreement = Agreement()
        self.glide = Glide()

    def measure(self, measured: Odometry | Sighting) -> tuple[Verdict, ...]:
        """Put a measurement in its place in time; what the gates said of it, nothing where it has no place."""
        timeline = self.timeline
        if timeline is None:
            self._start(measured)
            return ()
        time_s, newest_s = measured.time_s, timeline.newest.time_s
        if time_s > newest_s + JUMP_AHEAD_S and not self._clock.believes(time_s):
            self._counters.ahead += 1
            return ()
        self._clock.not_ahead()
        if time_s - newest_s > LONGEST_GAP_S:
            self._restart(measured)
        elif time_s < timeline.oldest.time_s:
            self._counters.dropped += 1
            if self._clock.was_set_back(time_s):
                self._restart(measured)
        elif timeline.holds(measured):
            self._counters.duplicates += 1
        else:
            self._clock.in_order()
            if isinstance(measured, Sighting):
                return self._sight(timeline, measured)
            return self._move(timeline, measured)
        return ()

    def feel(self, sample: AccelerometerSample) -> None:
        """A sample of the accelerometer: used in the air, where the filter stands; it never moves the filter's time."""
        timeline = self.timeline
        if timeline is None or not (self._feels and self._drive.flies):
            return
        felt = checked_accelerometer(sample)
        if felt is None:
            self._counters.non_finite += 1
            return
        felt = self.bias.corrected(felt)
        if felt is None:
            self._counters.rejected[s.ACCELEROMETER_SENSOR] += 1
            return
        behind_s = timeline.newest.time_s - felt.time_s
        if not abs(behind_s) < FELT_WITHIN_S or felt.time_s < timeline.oldest.time_s:
            self._counters.dropped += 1
        elif timeline.holds(felt):
            self._counters.duplicates += 1
        else:
            verdict = (timeline.insert(felt) if behind_s > 0.0 else timeline.append(felt.time_s, felt, True))[0]
            self.statistics[verdict.sensor] = (verdict.nis, verdict.dof)
            self._counters.rejected[verdict.sensor] += not verdict.accepted

    def forget(self, marker_id: int) -> None:
        """Take a marker out of the filter: its next sighting is the first."""
        if self.timeline is not None:
            self.timeline.forget(marker_id)
        self.sightings.forget(marker_id)

    def _move(self, timeline: Timeline, measured: Odometry) -> tuple[Verdict, ...]:
        time_s = measured.time_s
        if time_s < timeline.newest.time_s:
            self._counters.late += 1
            verdicts = timeline.insert(measured)
            self._note(measured, verdicts)
            return verdicts
        self.agreement.look(measured, timeline.newest.position_sigma_m)
        self._stepper.agrees = self.agreement.agrees
        verdicts = timeline.append(time_s, measured, self._drive.flies)
        self._note(measured, verdicts)
        self.drift.look(measured, verdicts)
        self._stepper.bias_free = self.drift.runs_away
        self.journal.follow(time_s, timeline.newest)
        return verdicts

    def _sight(self, timeline: Timeline, sighting: Sighting) -> tuple[Verdict, ...]:
        """A sighting, mostly late; the first after a while may move the filter, and what is told then glides there."""
        before = timeline.newest
        if sighting.time_s >= before.time_s:
            verdicts = timeline.append(sighting.time_s, sighting, self._drive.flies)
        else:
            self._counters.late += 1
            verdicts = timeline.insert(sighting)
        self._note(sighting, verdicts)
        after = timeline.newest
        if before.sighted_s and sighting.time_s - max(before.sighted_s) > GLIDE_AFTER_S:
            self._regained_s = sighting.time_s
        if sighting.time_s - self._regained_s < GLIDE_FOR_S:
            was = self._stepper.extrapolated(before, after.time_s)[s.POSITION]
            self.glide.stepped(after.time_s, after.packed[s.POSITION] - was)
        return verdicts

    def _start(self, measured: Odometry | Sighting) -> None:
        if isinstance(measured, Odometry) and measured.complete:
            self.timeline = Timeline(self._stepper, self._stepper.start(measured, self._drive.flies))
            self._clock.in_order()

    def _restart(self, measured: Odometry | Sighting) -> None:
        if isinstance(measured, Odometry) and measured.complete:
            self._counters.restarts += 1
            self._start(measured)

    def _note(self, measured: Odometry | Sighting, verdicts: tuple[Verdict, ...]) -> None:
        time_s = measured.time_s
        for verdict in verdicts:
            if isinstance(measured, Sighting):
                self.sightings.note(time_s, measured.marker_id, verdict)
            self.statistics[verdict.sensor] = (verdict.nis, verdict.dof)
            self.journal.note(time_s, verdict)
            if not verdict.accepted:
                self._counters.rejected[verdict.sensor] += 1
