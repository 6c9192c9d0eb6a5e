"""Watching and responding: monitors look ten times a second, and the worst of what they find acts in each cycle."""

from __future__ import annotations

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.authority import AuthorityMeter
from uasfly.control.protocol import ControlResult
from uasfly.flight.course import Course
from uasfly.flight.leaving import LEAVING, leave_mission
from uasfly.flight.marker_guide import MarkerGuide
from uasfly.flight.monitors import Monitors, Watched
from uasfly.flight.places import Places
from uasfly.flight.response import Response
from uasfly.flight.sequencer import Sequencer
from uasfly.flight.view import VehicleView
from uasfly.messages import Action, Alarm, Array, Authority, StateEstimate
from uasfly.mission import Mission
from uasfly.observer.observer import Observer
from uasfly.wind_messages import WindEstimate


class Supervisor:
    """Supervises one flight.

    Args:
        mission, airframe: what is flown, with the monitors' settings.
        observer: diagnoses, and is told whether to trust a marker.
        view: what the vehicle has said.
        sequencer: ended or left where an alarm wants it, and tells what is announced.
        course: slowed down, held or turned back.
        places: home.
        guide: to the marker that the mission hangs on; None where it hangs on none.

    Attributes:
        alarms: of the monitors' last look.
        authority: what the wind had taken then; None before the first.
        action: that the alarms want, NOTHING where uasfly does not fly the legs.
    """

    def __init__(
        self,
        mission: Mission,
        airframe: Airframe,
        observer: Observer,
        view: VehicleView,
        sequencer: Sequencer,
        course: Course,
        places: Places,
        guide: MarkerGuide | None,
    ) -> None:
        self.alarms: tuple[Alarm, ...] = ()
        self.authority: Authority | None = None
        self.action = Action.NOTHING
        self._settings = mission.monitors
        self._observer = observer
        self._view = view
        self._sequencer = sequencer
        self._course = course
        self._places = places
        self._guide = guide
        self._monitors = Monitors(mission, airframe)
        self._meter = AuthorityMeter(airframe.limits, airframe.model, mission.transition.speed_m_s)
        self._response = Response()

    def step(
        self,
        time_s: float,
        estimate: StateEstimate,
        reference: Array | None,
        wind: WindEstimate | None,
        control: ControlResult | None,
        *,
        acting: bool,
        k_thrust_m_s2: float,
    ) -> bool:
        """Watch, and do what the worst alarm asks for.

        Args:
            time_s: now.
            estimate: for now.
            reference: (3,) m, world: where the vehicle should be now; None where uasfly does not fly it from a known
                origin.
            wind: for now, None where it is not known.
            control: of the cycle before.
            acting: whether uasfly flies the legs, so that actions can be done; otherwise alarms are only told.
            k_thrust_m_s2: thrust acceleration at full command.

        Returns:
            Whether the mission was told to end.
        """
        if self._monitors.due(time_s, control):
            self._look(time_s, estimate, reference, wind, k_thrust_m_s2)
        self.alarms = self._monitors.alarms
        if self._guide is not None:
            self._guide.judge(self._observer, self.alarms, self._course.begun)
            self._sequencer.announcements += self._guide.announcements
            self._guide.announcements.clear()
        self._sequencer.announcements += self._response.update(time_s, self.alarms, acting)
        self.action = self._response.action
        return acting and self._respond(time_s)

    def _look(
        self,
        time_s: float,
        estimate: StateEstimate,
        reference: Array | None,
        wind: WindEstimate | None,
        k_thrust_m_s2: float,
    ) -> None:
        """Ask the monitors; they look while uasfly flies, and at some things always."""
        course, guide, home = self._course, self._guide, self._places.home
        way_home = home - estimate.position_in_world
        self.authority = self._meter.update(time_s, estimate.force_in_world, k_thrust_m_s2, way_home)
        self._monitors.look(
            Watched(
                time_s=time_s,
                flying=reference is not None,
                estimate=estimate,
                diagnosis=self._observer.diagnose(time_s, self._settings.estimate.window_s),
                view=self._view,
                origin=np.zeros(3) if course.origin is None else course.origin,
                home=home,
                reference=reference,
                authority=self.authority,
                marker=None if guide is None else guide.marker,
                by_marker=guide is not None and course.begun,
                wind=wind,
                carried=self._observer.carried,
            )
        )

    def _respond(self, time_s: float) -> bool:
        """Whether the mission was told to end."""
        response, settings = self._response, self._settings
        if response.action in LEAVING:
            leave_mission(self._sequencer, time_s, response.action, response.text)
        elif response.since_s is not None and time_s - response.since_s > settings.longest_hold_s:
            self._sequencer.end(time_s, f"held for {settings.longest_hold_s:.0f} s: {response.text}")
        else:
            self._course.act(time_s, response.action, settings.slow_pace, settings.back_off_m)
            return False
        return True
