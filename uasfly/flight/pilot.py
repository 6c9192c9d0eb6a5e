"""The pure step: measurements in, one setpoint and one status out. No sockets, clocks, files, threads or asyncio.

The same step serves the live flight, the rehearsal and the replay of a log: same input, same output, bit for bit.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.authority import AuthorityMeter
from uasfly.control.controller import Controller, ControlResult
from uasfly.flight.choices import EndingAction, Engage
from uasfly.flight.clearance import Clearance
from uasfly.flight.course import NOT_BEGUN, Course
from uasfly.flight.echo import echo, told
from uasfly.flight.marker_guide import MarkerGuide
from uasfly.flight.monitors import Monitors, Watched
from uasfly.flight.preflight import Preflight, announcements, as_pilot_flies, stop_reason
from uasfly.flight.response import Response
from uasfly.flight.sequencer import Sequencer
from uasfly.flight.trimmed_thrust import TrimmedThrust
from uasfly.flight.view import VehicleView
from uasfly.message_class import message
from uasfly.messages import (
    Action,
    Alarm,
    Array,
    Authority,
    Phase,
    ReferenceHorizon,
    Request,
    Sample,
    Setpoint,
    StateEstimate,
    Status,
)
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis
from uasfly.observer.observer import Observer
from uasfly.observer.pairs import paired
from uasfly.preflight_messages import PreflightCheck
from uasfly.wind.drag_curve import wind_settings
from uasfly.wind.meter import WindMeter
from uasfly.wind_messages import WindEstimate

_ENDINGS = {Action.END: None, Action.RETURN: EndingAction.RETURN, Action.LAND: EndingAction.LAND}


@message
class StepResult:
    """What a step wants: a setpoint to send (None: send nothing), requests to the vehicle, and what it has to say.

    `preflight` holds the checks in the step in which they were made.
    """

    setpoint: Setpoint | None
    requests: tuple[Request, ...]
    status: Status
    control: ControlResult | None
    preflight: tuple[PreflightCheck, ...] = ()


class Pilot:
    """Flies one mission: observer, controller and phases behind one call a cycle.

    Args:
        airframe, mission: what is flown.
        observer, controller: made for this airframe.
        engage: who brings the vehicle into offboard.
        preflight: whether a preflight check comes before each take-off; its facts (`FactsSample`) have to be handed in.
        only_check: the flight is over after the preflight check.
        marker_id: number of the mission's bundle in the sightings; without it the first that is seen.
    """

    def __init__(
        self,
        airframe: Airframe,
        mission: Mission,
        observer: Observer,
        controller: Controller,
        engage: Engage,
        *,
        preflight: bool = False,
        only_check: bool = False,
        marker_id: int | None = None,
    ) -> None:
        self.airframe = airframe
        self.mission = mission
        self.observer = observer
        self.controller = controller
        self.view = VehicleView()
        self.sequencer = Sequencer(
            engage,
            mission.takeoff.height_m,
            EndingAction(mission.ending.action),
            mission.monitors.telemetry,
            clearance=Clearance(needed=preflight, only_check=only_check),
        )
        self._preflight = Preflight(mission, airframe, engage)
        self.monitors = Monitors(mission, airframe)
        self.course = Course(mission, airframe.limits)
        self._guide: MarkerGuide | None = None
        observer.retakes_moved = mission.marker is None  # else it is the guide's to say
        if mission.marker is not None:
            self._guide = MarkerGuide(mission.marker, marker_id, airframe.limits.yaw_rate_rad_s)
        self._meter = AuthorityMeter(airframe.limits, airframe.model, mission.transition.speed_m_s)
        self._authority: Authority | None = None  # at the monitors' last look
        wind = wind_settings(airframe)
        feels = airframe.observer.accelerometer_sigma_m_s2 is not None
        self._wind_meter = None if wind is None else WindMeter(wind, airframe.limits, feels)
        self._wind: WindEstimate | None = None
        self._response = Response()
        self._thrust = TrimmedThrust(observer, controller)
        self._estimate: StateEstimate | None = None  # of the last step
        self._phase = self.sequencer.phase  # as far as this object has followed it
        self._ground: Array | None = None  # where the vehicle last stood
        self._met: Array | None = None  # where it was first known
        self._leg_started = False
        self._streamed = False
        self._control: ControlResult | None = None
        self._time_s: float | None = None
        self._reference: Array | None = None  # (3,) m, world: where the vehicle should be in this step

    @property
    def done(self) -> bool:
        """Whether the flight has ended, one way or another."""
        return self.sequencer.phase in (Phase.DONE, Phase.ABORTED)

    def interrupt(self, time_s: float, reason: str) -> None:
        """The operator wants it to end: once, hold and then the ending; twice, hand over at once."""
        self.sequencer.interrupt(time_s, reason)

    def leave(self, time_s: float, reason: str) -> None:
        """Something is broken: end the flight at once, see `Sequencer.leave`."""
        self.sequencer.leave(time_s, reason)

    def announce(self, severity: int, text: str) -> None:
        """Have a text told with the next step's status."""
        self.sequencer.announcements.append((severity, text))

    def reference_at(self, times_s: Array) -> ReferenceHorizon:
        """Reference at absolute times (n,) [s, host], in the world frame."""
        return self.course.at(times_s)

    def step(self, time_s: float, samples: tuple[Sample, ...]) -> StepResult:
        """One control cycle.

        Args:
            time_s: now, host time.
            samples: what has arrived since the last cycle.
        """
        self._take_in(samples)
        meter = self._wind_meter
        text = self._thrust.step(time_s, self._estimate, self.view.in_air, self._wind)
        if text:
            self.announce(4, text)
        k_thrust = self._thrust.k_thrust_m_s2(self.view.voltage_v)
        self.observer.set_k_thrust(k_thrust)
        estimate = self._estimate = self.observer.estimate(time_s)
        if estimate is not None:
            self._note_places(estimate)

        if meter is not None:
            self._wind = meter.step(time_s, estimate, self.view.in_air, k_thrust)
        sequencer = self.sequencer
        for number, away_m in self.observer.take_moved():
            self.announce(4, f"bundle {number} is seen {away_m:.2f} m from where it was: moved; it is taken anew")
        requests = sequencer.step(time_s, self.view, estimate, self.course.done(time_s))
        checks = self._check_before_flight(time_s, samples, estimate)
        setpoint, control = None, None
        self._reference = None
        alarms: tuple[Alarm, ...] = ()
        if estimate is not None:
            if self._guide is not None:
                self._guide.look(time_s, self.observer)
            self._follow_phase(time_s, estimate)
            alarms = self._watch(time_s, estimate, k_thrust)
            self._respond(time_s, estimate, alarms)
        if sequencer.streaming and estimate is not None:
            setpoint = None if sequencer.in_offboard else echo(self.view, time_s, self.airframe.limits)
            if setpoint is None:
                if not self._streamed:
                    self.controller.reset(time_s, told(self.view, time_s))
                seen = self._thrust.as_commanded(estimate)
                control = self.controller.step(time_s, seen, self.reference_at, self.view.voltage_v)
                setpoint = control.setpoint
                if control.text:
                    sequencer.announcements.append((4, control.text))
            self.observer.sent(setpoint, in_offboard=sequencer.in_offboard)
        self._streamed = setpoint is not None
        self._control, self._time_s = control, time_s
        return StepResult(setpoint, requests, self._status(time_s, estimate, alarms), control, checks)

    def _take_in(self, samples: tuple[Sample, ...]) -> None:
        self.view.update(samples)
        for sample in paired(samples):
            self.observer.add(sample)
        if self._wind_meter is not None:
            for sample in samples:
                self._wind_meter.add(sample)

    def _check_before_flight(
        self, time_s: float, samples: tuple[Sample, ...], estimate: StateEstimate | None
    ) -> tuple[PreflightCheck, ...]:
        """Judge once, when all else is ready or has been given up; where the pilot flies already nothing stops."""
        sequencer, preflight = self.sequencer, self._preflight
        if sequencer.phase in (Phase.CONNECT, Phase.PREFLIGHT):
            preflight.look(time_s, samples, self.view)
        if not sequencer.clearance.awaited or not (self.done or preflight.has_facts(time_s)):
            return ()
        diagnosis = None if estimate is None else self._diagnosis(time_s)
        origin = None if estimate is None else self._origin_of(estimate)
        checks = preflight.judge(self.view, estimate, diagnosis, origin)
        if self.view.in_air and sequencer.engage is Engage.PILOT and not sequencer.clearance.only_check:
            checks = as_pilot_flies(checks)
        sequencer.announcements += announcements(checks)
        sequencer.clear(time_s, stop_reason(checks))
        return checks

    def _diagnosis(self, time_s: float) -> Diagnosis:
        return self.observer.diagnose(time_s, self.mission.monitors.estimate.window_s)

    def _note_places(self, estimate: StateEstimate) -> None:
        if self._met is None:
            self._met = estimate.position_in_world
        if not (self.view.armed or self.view.in_air):
            self._ground = estimate.position_in_world

    def _follow_phase(self, time_s: float, estimate: StateEstimate) -> None:
        """Origin and reference for the phase that the flight is in now."""
        sequencer, course, guide = self.sequencer, self.course, self._guide
        before, self._phase = self._phase, sequencer.phase
        changed = before is not self._phase
        if guide is not None and self._phase in (Phase.ENGAGE, Phase.LEGS):
            guide.place(course)
        match self._phase:
            case Phase.PREFLIGHT if changed:
                course.drop()
            case Phase.TAKEOFF if changed:
                course.origin = self._origin_of(estimate)
            case Phase.ENGAGE:
                if before is Phase.LEGS:
                    course.freeze(time_s)
                elif changed and before is not Phase.TAKEOFF:
                    course.origin = self._origin_of(estimate)
                course.engage(time_s, estimate)
                if guide is not None:
                    guide.stop_waiting()
            case Phase.LEGS:
                self._follow_legs(time_s, estimate, changed)
            case Phase.ENDING if changed and not course.done(time_s):
                course.stay(time_s, estimate)  # what has been announced; the reference would fly on
        if course.problem and self._phase in (Phase.ENGAGE, Phase.LEGS):
            sequencer.end(time_s, course.problem)

    def _follow_legs(self, time_s: float, estimate: StateEstimate, changed: bool) -> None:
        """Begin, freeze or take up; the controller then starts from what the vehicle is told."""
        course, sequencer = self.course, self.sequencer
        if not course.begun:
            if changed or sequencer.silence_ended:
                course.start(time_s, estimate)
            if not course.begun and self._guide is not None and sequencer.streaming:
                self._wait(time_s, self._guide)
        elif changed or sequencer.silence_ended:
            course.freeze(time_s if self._time_s is None else self._time_s)
            course.take_up(time_s, estimate)
        elif not sequencer.streaming:
            course.freeze(time_s)
        if changed or sequencer.silence_ended:
            self._streamed = False

    def _wait(self, time_s: float, guide: MarkerGuide) -> None:
        """In offboard, but nobody knows yet where the marker is."""
        assert self.mission.marker is not None
        text = guide.wait(self.course)
        if text:
            self._leave_mission(time_s, Action(self.mission.marker.until_seen.then), text)

    def _leave_mission(self, time_s: float, action: Action, reason: str) -> None:
        """One of the actions after which the mission is over."""
        if action is Action.HAND_OVER:
            self.sequencer.leave(time_s, reason)
        else:
            self.sequencer.end(time_s, reason, _ENDINGS[action])

    def _watch(self, time_s: float, estimate: StateEstimate, k_thrust: float) -> tuple[Alarm, ...]:
        """Ask the monitors; they look while uasfly flies, and at some things always."""
        origin = self.course.origin
        flying = self._phase is Phase.LEGS and self.sequencer.streaming and origin is not None
        self._reference = self.course.place_at(time_s) if flying else None
        guide = self._guide
        if self.monitors.due(time_s, self._control):
            self._authority = self._measure_authority(time_s, estimate, k_thrust)
            place = np.zeros(3) if origin is None else origin
            self.monitors.look(
                Watched(
                    time_s=time_s,
                    flying=flying,
                    estimate=estimate,
                    diagnosis=self._diagnosis(time_s),
                    view=self.view,
                    origin=place,
                    home=self._home(place),
                    reference=self._reference,
                    authority=self._authority,
                    marker=None if guide is None else guide.marker,
                    by_marker=guide is not None and self.course.begun,
                    wind=self._wind,
                )
            )
        alarms = self.monitors.alarms
        if guide is not None:
            guide.judge(self.observer, alarms, self.course.begun)
            self.sequencer.announcements += guide.announcements
            guide.announcements.clear()
        return alarms

    def _respond(self, time_s: float, estimate: StateEstimate, alarms: tuple[Alarm, ...]) -> None:
        """Do what the worst alarm asks for, where uasfly flies."""
        sequencer, response, settings = self.sequencer, self._response, self.mission.monitors
        acting = self._phase is Phase.LEGS and sequencer.streaming
        sequencer.announcements += response.update(time_s, alarms, acting)
        if not acting:
            return
        if response.action is Action.HAND_OVER or response.action in _ENDINGS:
            self._leave_mission(time_s, response.action, response.text)
        elif response.since_s is not None and time_s - response.since_s > settings.longest_hold_s:
            sequencer.end(time_s, f"held for {settings.longest_hold_s:.0f} s: {response.text}")
        else:
            self.course.act(time_s, response.action, settings.slow_pace, settings.back_off_m)
            return
        self._follow_phase(time_s, estimate)

    def _measure_authority(self, time_s: float, estimate: StateEstimate, k_thrust_m_s2: float) -> Authority:
        home = self._home(estimate.position_in_world)
        return self._meter.update(time_s, estimate.force_in_world, k_thrust_m_s2, home - estimate.position_in_world)

    def _home(self, otherwise: Array) -> Array:
        """Where the vehicle stood before it took off, or was first met."""
        for place in (self._ground, self._met):
            if place is not None:
                return place
        return otherwise

    def _origin_of(self, estimate: StateEstimate) -> Array:
        if self.mission.frame == "local":
            return np.zeros(3)
        if self._phase is Phase.TAKEOFF:
            return estimate.position_in_world
        if self._ground is not None:
            return self._ground
        x, y, _ = estimate.position_in_world.tolist()
        return np.array((x, y, 0.0))  # met in the air: PX4's local origin lies on the ground where it booted

    def _status(self, time_s: float, estimate: StateEstimate | None, alarms: tuple[Alarm, ...]) -> Status:
        sequencer, course, view = self.sequencer, self.course, self.view
        in_legs = sequencer.phase is Phase.LEGS
        progress = course.progress(time_s) if in_legs or sequencer.phase is Phase.ENGAGE else NOT_BEGUN
        leg = progress.leg if in_legs else -1
        self._leg_started |= leg >= 0
        reference = None
        if in_legs and (course.begun or self._guide is not None):
            reference = course.place_at(time_s) if self._reference is None else self._reference
        announcements = tuple(sequencer.announcements)
        sequencer.announcements.clear()
        battery = view.battery
        return Status(
            time_s=time_s,
            phase=sequencer.phase,
            leg=leg,
            leg_started=self._leg_started and in_legs,
            progress=1.0 if sequencer.phase in (Phase.ENDING, Phase.DONE) else progress.share,
            estimate=estimate,
            reference_position_in_world=reference,
            fallback=self._control.fallback if self._control is not None else "",
            reason=sequencer.reason,
            announcements=announcements,
            mode=view.mode,
            armed=view.armed,
            battery_remaining=math.nan if battery is None else battery.remaining,
            battery_voltage_v=view.voltage_v or math.nan,
            telemetry_age_s=view.odometry_age_s(time_s),
            authority=None if estimate is None else self._authority,
            alarms=alarms,
            action=self._response.action,
            pace=progress.pace if in_legs else 0.0,
            pilot_flies=sequencer.pilot_flies,
            marker_age_s=math.nan if self._guide is None else self._guide.age_s,
            waits_for="the marker" if in_legs and self._guide is not None and not course.begun else "",
            wind=self._wind,
            thrust_trim=self._thrust.trim,
        )
