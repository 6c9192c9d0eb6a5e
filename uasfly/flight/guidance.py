"""Guidance: what each phase of the flight makes of the mission's origin and of its course."""

from __future__ import annotations

from uasfly.flight.course import Course
from uasfly.flight.leaving import leave_mission
from uasfly.flight.marker_guide import MarkerGuide
from uasfly.flight.places import Places
from uasfly.flight.sequencer import Sequencer
from uasfly.messages import Action, Phase, StateEstimate
from uasfly.mission import Mission


class Guidance:
    """Lets the course follow the phases of one flight.

    Args:
        mission: what is flown.
        sequencer: of the flight; ended where the mission cannot be flown.
        course: is told what to do.
        places: the origin comes from there.
        guide: to the marker that the mission hangs on; None where it hangs on none.
    """

    def __init__(
        self, mission: Mission, sequencer: Sequencer, course: Course, places: Places, guide: MarkerGuide | None
    ) -> None:
        self._mission = mission
        self._sequencer = sequencer
        self._course = course
        self._places = places
        self._guide = guide
        self._phase = sequencer.phase  # as far as this object has followed it

    @property
    def flies_legs(self) -> bool:
        """Whether uasfly flies the vehicle by the course."""
        return self._phase is Phase.LEGS and self._sequencer.streaming

    def follow(self, time_s: float, estimate: StateEstimate, before_s: float) -> bool:
        """Origin and reference for the phase that the flight is in now.

        Args:
            time_s: now.
            estimate: for now.
            before_s: time of the cycle before.

        Returns:
            Whether the legs begin or go on now, so that the controller starts from what the vehicle is told.
        """
        sequencer, course, guide = self._sequencer, self._course, self._guide
        before, self._phase = self._phase, sequencer.phase
        changed, afresh = before is not self._phase, False
        if guide is not None and self._phase in (Phase.ENGAGE, Phase.LEGS):
            guide.place(course)
        match self._phase:
            case Phase.PREFLIGHT if changed:
                course.drop()
            case Phase.TAKEOFF if changed:
                course.origin = self._places.origin(estimate, takes_off=True)
            case Phase.ENGAGE:
                if before is Phase.LEGS:
                    course.freeze(time_s)
                elif changed and before is not Phase.TAKEOFF:
                    course.origin = self._places.origin(estimate)
                course.engage(time_s, estimate)
                if guide is not None:
                    guide.stop_waiting()
            case Phase.LEGS:
                afresh = changed or sequencer.silence_ended
                self._follow_legs(time_s, estimate, before_s, afresh)
            case Phase.ENDING if changed and not course.done(time_s):
                course.stay(time_s, estimate)  # what has been announced; the reference would fly on
        if course.problem and self._phase in (Phase.ENGAGE, Phase.LEGS):
            sequencer.end(time_s, course.problem)
        return afresh

    def _follow_legs(self, time_s: float, estimate: StateEstimate, before_s: float, afresh: bool) -> None:
        """Begin, freeze or take up."""
        course, sequencer = self._course, self._sequencer
        if not course.begun:
            if afresh:
                course.start(time_s, estimate)
            if not course.begun and self._guide is not None and sequencer.streaming:
                self._wait(time_s, self._guide)
        elif afresh:
            course.freeze(before_s)
            course.take_up(time_s, estimate)
        elif not sequencer.streaming:
            course.freeze(time_s)

    def _wait(self, time_s: float, guide: MarkerGuide) -> None:
        """In offboard, but nobody knows yet where the marker is."""
        assert self._mission.marker is not None
        text = guide.wait(self._course)
        if text:
            leave_mission(self._sequencer, time_s, Action(self._mission.marker.until_seen.then), text)
