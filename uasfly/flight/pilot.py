"""The pure step: measurements in, one setpoint and one status out. No sockets, clocks, files, threads or asyncio.

The same step serves the live flight, the rehearsal and the replay of a log: same input, same output, bit for bit.
"""

from __future__ import annotations

from uasfly.airframe import Airframe
from uasfly.control.controller import Controller, ControlResult
from uasfly.flight.choices import EndingAction, Engage
from uasfly.flight.clearance import Clearance
from uasfly.flight.course import Course
from uasfly.flight.echo import echo, told
from uasfly.flight.guidance import Guidance
from uasfly.flight.marker_guide import MarkerGuide
from uasfly.flight.places import Places
from uasfly.flight.preflight import Preflight, announcements, as_pilot_flies, stop_reason
from uasfly.flight.reporter import Reporter
from uasfly.flight.sequencer import Sequencer
from uasfly.flight.supervisor import Supervisor
from uasfly.flight.trimmed_thrust import TrimmedThrust
from uasfly.flight.view import VehicleView
from uasfly.message_class import message
from uasfly.messages import Array, Phase, ReferenceHorizon, Request, Sample, Setpoint, StateEstimate, Status
from uasfly.mission import Mission
from uasfly.observer.observer import Observer
from uasfly.observer.pairs import paired
from uasfly.preflight_messages import PreflightCheck
from uasfly.wind.drag_curve import wind_settings
from uasfly.wind.meter import WindMeter
from uasfly.wind_messages import WindEstimate


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
        self.course = Course(mission, airframe.limits)
        self._preflight = Preflight(mission, airframe, engage)
        wind = wind_settings(airframe)
        feels = airframe.observer.accelerometer_sigma_m_s2 is not None
        self._wind_meter = None if wind is None else WindMeter(wind, airframe.limits, feels)
        self._thrust = TrimmedThrust(observer, controller)
        self._guide: MarkerGuide | None = None
        observer.retakes_moved = mission.marker is None  # else it is the guide's to say
        if mission.marker is not None:
            self._guide = MarkerGuide(mission.marker, marker_id, airframe.limits.yaw_rate_rad_s)
        view, sequencer, course, guide = self.view, self.sequencer, self.course, self._guide
        self._places = places = Places(mission.frame)
        self._guidance = Guidance(mission, sequencer, course, places, guide)
        self._supervisor = Supervisor(mission, airframe, observer, view, sequencer, course, places, guide)
        self._reporter = Reporter(view, sequencer, course, self._supervisor, self._thrust, guide)
        # of the cycle before, where there was one
        self._time_s: float | None = None
        self._estimate: StateEstimate | None = None
        self._wind: WindEstimate | None = None
        self._control: ControlResult | None = None
        self._streamed = False

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
            self._places.note(estimate, stands=not (self.view.armed or self.view.in_air))
        if meter is not None:
            self._wind = meter.step(time_s, estimate, self.view.in_air, k_thrust)
        sequencer = self.sequencer
        for number, away_m in self.observer.take_moved():
            self.announce(4, f"bundle {number} is seen {away_m:.2f} m from where it was: moved; it is taken anew")
        requests = sequencer.step(time_s, self.view, estimate, self.course.done(time_s))
        checks = self._check_before_flight(time_s, samples, estimate)
        reference: Array | None = None  # (3,) m, world: where the vehicle should be in this cycle
        if estimate is not None:
            reference = self._guide_and_supervise(time_s, estimate, k_thrust)
        setpoint, control = None, None
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
        status = self._reporter.status(time_s, estimate, reference, self._wind, control)
        return StepResult(setpoint, requests, status, control, checks)

    def _take_in(self, samples: tuple[Sample, ...]) -> None:
        self.view.update(samples)
        for sample in paired(samples):
            self.observer.add(sample)
        if self._wind_meter is not None:
            for sample in samples:
                self._wind_meter.add(sample)

    def _guide_and_supervise(self, time_s: float, estimate: StateEstimate, k_thrust_m_s2: float) -> Array | None:
        """Let guidance follow the phase, and again where the monitors end it; where the vehicle should be meanwhile."""
        course, guidance = self.course, self._guidance
        if self._guide is not None:
            self._guide.look(time_s, self.observer)
        before_s = time_s if self._time_s is None else self._time_s
        if guidance.follow(time_s, estimate, before_s):
            self._streamed = False
        acting = guidance.flies_legs
        reference = course.place_at(time_s) if acting and course.origin is not None else None
        if self._supervisor.step(
            time_s, estimate, reference, self._wind, self._control, acting=acting, k_thrust_m_s2=k_thrust_m_s2
        ):
            guidance.follow(time_s, estimate, before_s)
        return reference

    def _check_before_flight(
        self, time_s: float, samples: tuple[Sample, ...], estimate: StateEstimate | None
    ) -> tuple[PreflightCheck, ...]:
        """Judge once, when all else is ready or has been given up; where the pilot flies already nothing stops."""
        sequencer, preflight = self.sequencer, self._preflight
        if sequencer.phase in (Phase.CONNECT, Phase.PREFLIGHT):
            preflight.look(time_s, samples, self.view)
        if not sequencer.clearance.awaited or not (self.done or preflight.has_facts(time_s)):
            return ()
        diagnosis, origin = None, None
        if estimate is not None:
            diagnosis = self.observer.diagnose(time_s, self.mission.monitors.estimate.window_s)
            origin = self._places.origin(estimate)
        checks = preflight.judge(self.view, estimate, diagnosis, origin)
        if self.view.in_air and sequencer.engage is Engage.PILOT and not sequencer.clearance.only_check:
            checks = as_pilot_flies(checks)
        sequencer.announcements += announcements(checks)
        sequencer.clear(time_s, stop_reason(checks))
        return checks
