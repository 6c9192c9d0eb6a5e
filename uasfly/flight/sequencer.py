"""The phases of a flight: connect, preflight, take-off, engage, legs, ending (sans-I/O, no clock of its own).

The pilot's switch always wins: when the vehicle changes its mode without having been asked to, nothing more is asked
and nothing that is sent acts. In the legs the mission then waits: the pilot's next switch to offboard takes it up.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from uasfly.flight.asking import Asking
from uasfly.flight.choices import ENDING_MODES, ENDING_REQUESTS, EndingAction, Engage
from uasfly.flight.clearance import Clearance
from uasfly.flight.readiness import unready
from uasfly.flight.silence import Silence
from uasfly.flight.view import VehicleView
from uasfly.messages import FlightMode, Phase, Request, RequestKind, RequestResult, StateEstimate
from uasfly.monitor_settings import TelemetryMonitor

PREFLIGHT_TIMEOUT_S = 30.0
TAKEOFF_TIMEOUT_S = 60.0
READY_S = 1.0  # readiness counts when it lasts
SETTLE_S = 4.0  # in hold after take-off: the wind force is learned here
STREAM_BEFORE_OFFBOARD_S = 0.6  # PX4 wants a stream before it enters offboard
ENGAGE_TIMEOUT_S = 10.0
RETRY_S = 1.0
LANDING_TIMEOUT_S = 240.0
HEARTBEAT_GRACE_S = 1.5  # a heartbeat that tells the old mode may still be on its way after an accepted change
DISCONNECT_S = 15.0
REFUSALS = 2  # of the ending, before the stream is left to PX4's failsafe


@dataclass(slots=True)
class Sequencer:
    """State machine of a flight.

    Attributes:
        engage: who brings the vehicle into offboard.
        takeoff_height_m: height above ground of the take-off.
        ending: what follows the legs.
        telemetry: what counts as silence.
        phase, reason: where the flight is, and why it ends or has ended early.
        streaming: whether setpoints are to be sent in this step.
        hand_over: uasfly leaves a vehicle that it was flying: the driver's last request must be hold.
        taken_over: somebody else has taken the vehicle out of the legs; the mission waits.
        silence: of the telemetry, and of this cycle itself.
        silence_ended: a silence after which the mission goes on has ended in this step.
        clearance: where the preflight check stands; `clear` tells its outcome.
        announcements: new texts with their MAVLink severity, cleared by the reader.
    """

    engage: Engage
    takeoff_height_m: float
    ending: EndingAction
    telemetry: TelemetryMonitor = field(default_factory=TelemetryMonitor)
    phase: Phase = Phase.CONNECT
    reason: str = ""
    streaming: bool = False
    hand_over: bool = False
    announcements: list[tuple[int, str]] = field(default_factory=list)
    taken_over: bool = False
    silence_ended: bool = False
    clearance: Clearance = field(default_factory=Clearance)
    silence: Silence = field(init=False)
    _entered_s: float = 0.0
    _asking: Asking = field(default_factory=Asking)
    _offboard_since_s: float | None = None
    _ready_since_s: float | None = None
    _unready_since_s: float | None = None
    _mode: FlightMode = FlightMode.OTHER  # at the last step, or when the phase began
    _mode_seen: bool = False  # the mode that this phase asks for has been reported
    _interrupts: int = 0
    _abort_reason: str = ""

    def __post_init__(self) -> None:
        self.silence = Silence(self.telemetry)

    def step(
        self, time_s: float, view: VehicleView, estimate: StateEstimate | None, legs_done: bool
    ) -> tuple[Request, ...]:
        """One cycle.

        Args:
            time_s: now, host time.
            view: what the vehicle has said.
            estimate: the observer's answer for now.
            legs_done: the reference has come to its end.

        Returns:
            Requests to the vehicle, most often none.
        """
        requests: list[Request] = []
        for result in self._asking.answers(time_s, view.results):
            self._answered(time_s, result)
        self._watch_telemetry(time_s, view)
        match self.phase:
            case Phase.CONNECT:
                self._connect(time_s, view, estimate)
            case Phase.PREFLIGHT:
                self._preflight(time_s, view, estimate, requests)
            case Phase.TAKEOFF:
                self._takeoff(time_s, view, requests)
            case Phase.ENGAGE:
                self._engage(time_s, view, requests)
            case Phase.LEGS:
                self._legs(time_s, view, legs_done, requests)
            case Phase.ENDING:
                self._ending(time_s, view, requests)
            case _:
                pass
        self._mode = view.mode
        return tuple(requests)

    def interrupt(self, time_s: float, reason: str) -> None:
        """Stop the mission: the first call holds and then ends it, the second hands over at once.

        Where uasfly is not flying the vehicle, the first call already leaves it alone.
        """
        self._interrupts += 1
        if self.phase in (Phase.DONE, Phase.ABORTED):
            return
        if self._interrupts > 1:
            self.leave(time_s, reason)
        elif self.phase is Phase.ENDING:
            self.announcements.append((4, f"{reason}: the flight is ending already; once more hands over at once"))
        else:
            self.end(time_s, reason)

    def clear(self, time_s: float, reason: str) -> None:
        """The preflight check has been made: go on; with a reason nothing is armed and the flight is over."""
        self.clearance.awaited = False
        if self.phase is Phase.PREFLIGHT and reason:
            self._abort(time_s, reason)
        elif self.phase is Phase.PREFLIGHT and self.clearance.only_check:
            self._finish(time_s)
        else:
            self.clearance.given = True

    def end(self, time_s: float, reason: str, ending: EndingAction | None = None) -> None:
        """Leave the mission early: hold, then its ending (or this one); the outcome is "aborted" with this reason."""
        if self.phase in (Phase.ENDING, Phase.DONE, Phase.ABORTED):
            return
        if not self._flies:
            self._abort(time_s, reason)
            return
        self.reason = self._abort_reason = self._abort_reason or reason
        self.ending = ending or self.ending
        self.announcements.append((4, f"{reason}: holding, then {self.ending.value}"))
        self._enter(time_s, Phase.ENDING)

    def leave(self, time_s: float, reason: str) -> None:
        """Stop at once: no more setpoints; `hand_over` where the vehicle would be left without anybody."""
        if self.phase in (Phase.DONE, Phase.ABORTED):
            return
        ends_by_itself = self.phase is Phase.ENDING and ENDING_REQUESTS[self.ending] in self._asking.accepted
        self.hand_over = self._flies and not ends_by_itself
        self._abort(time_s, reason)

    @property
    def in_offboard(self) -> bool:
        """Whether uasfly's setpoints are what flies the vehicle."""
        return self._offboard_since_s is not None

    @property
    def pilot_flies(self) -> bool:
        """Whether the mission waits for the pilot, who has the vehicle, to switch to offboard."""
        return self.phase is Phase.ENGAGE and (self.taken_over or self.engage is Engage.PILOT)

    @property
    def _flies(self) -> bool:
        """Whether uasfly is in command, rather than nobody yet or the pilot."""
        if self.phase is Phase.ENGAGE:
            return self.engage is Engage.AUTO and not self.taken_over
        return self.phase in (Phase.TAKEOFF, Phase.LEGS, Phase.ENDING)

    # ------------------------------------------------------------------ phases

    def _connect(self, time_s: float, view: VehicleView, estimate: StateEstimate | None) -> None:
        if self._entered_s == 0.0:
            self._entered_s = time_s
        if estimate is not None and view.vehicle is not None:
            self._enter(time_s, Phase.PREFLIGHT)
        elif time_s - self._entered_s > DISCONNECT_S:
            missing = "heartbeat" if view.vehicle is None else "ODOMETRY"
            self._give_up(time_s, f"no {missing} from the vehicle within {DISCONNECT_S:.0f} s")

    def _preflight(
        self, time_s: float, view: VehicleView, estimate: StateEstimate | None, requests: list[Request]
    ) -> None:
        missing = unready(view, estimate)
        if missing:
            self._ready_since_s, self.clearance.awaited = None, False
            if self._unready_since_s is None:
                self._unready_since_s = time_s
            if time_s - self._unready_since_s > PREFLIGHT_TIMEOUT_S:
                self._give_up(time_s, f"not ready to fly after {PREFLIGHT_TIMEOUT_S:.0f} s: {missing}")
            return
        if self._ready_since_s is None:
            self._ready_since_s = time_s
        if time_s - self._ready_since_s < READY_S:
            return
        self._unready_since_s = None  # in pilot mode the wait may be long: only time in a row counts
        self.clearance.awaited = self.clearance.needed and not self.clearance.given
        if self.clearance.awaited:
            return
        if view.armed and view.in_air:
            self._enter(time_s, Phase.ENGAGE)
        elif self.engage is Engage.AUTO:
            self._enter(time_s, Phase.TAKEOFF)
            self._asking.ask(time_s, Request(RequestKind.ARM), requests)

    def _takeoff(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        accepted = self._asking.accepted
        if RequestKind.ARM in accepted and RequestKind.TAKEOFF not in accepted and self._asking.may_ask(time_s, -1.0):
            self._asking.ask(time_s, Request(RequestKind.TAKEOFF, self.takeoff_height_m), requests)
        self._mode_seen |= view.mode is FlightMode.TAKEOFF
        if self._mode_seen and view.mode not in (FlightMode.TAKEOFF, FlightMode.HOLD):
            self._taken(time_s, "take-off", view)
        elif RequestKind.TAKEOFF in accepted and view.in_air and view.mode is FlightMode.HOLD:
            if self._ready_since_s is None:
                self._ready_since_s = time_s
            if time_s - self._ready_since_s >= SETTLE_S:
                self._enter(time_s, Phase.ENGAGE)
        elif time_s - self._entered_s > TAKEOFF_TIMEOUT_S:
            self.end(time_s, f"take-off not finished within {TAKEOFF_TIMEOUT_S:.0f} s")

    def _engage(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        self.streaming = not self.silence.stale
        if not (view.armed and view.in_air) and (self.taken_over or self.engage is Engage.PILOT):
            self._landed(time_s)
            return
        if view.mode is FlightMode.OFFBOARD or RequestKind.OFFBOARD in self._asking.accepted:
            self._offboard_since_s = time_s
            if self.taken_over:
                self.announcements.append((5, "offboard again: the mission is taken up"))
                self.taken_over = False
            self._enter(time_s, Phase.LEGS)
            return
        if self.engage is Engage.PILOT or self.taken_over:
            return
        waited = time_s - self._entered_s
        if not view.armed:
            self._abort(time_s, "the vehicle has disarmed")
        elif view.mode is not self._mode and (self._mode, view.mode) != (FlightMode.TAKEOFF, FlightMode.HOLD):
            self._taken(time_s, self._mode.value, view)
        elif waited > ENGAGE_TIMEOUT_S:
            self.end(time_s, f"the vehicle did not enter offboard within {ENGAGE_TIMEOUT_S:.0f} s")
        elif waited > STREAM_BEFORE_OFFBOARD_S and self._asking.may_ask(time_s, RETRY_S):
            self._asking.ask(time_s, Request(RequestKind.OFFBOARD), requests)

    def _landed(self, time_s: float) -> None:
        """Whoever had the vehicle has landed it: the mission begins anew with the pilot's next flight, or is over."""
        self.streaming = False
        if self.engage is Engage.PILOT:
            self.taken_over = False
            self._enter(time_s, Phase.PREFLIGHT)
        else:
            self._abort(time_s, "the vehicle was taken over and has landed")

    def _legs(self, time_s: float, view: VehicleView, legs_done: bool, requests: list[Request]) -> None:
        self.streaming = not self.silence.stale
        if self.silence.stale:
            return
        if not view.armed:
            self._abort(time_s, "the vehicle has disarmed in flight")
        elif self._left_offboard(time_s, view):
            self._offboard_since_s = None
            self.taken_over = True
            text = f"the vehicle left offboard for {view.mode.value}: the pilot, or a failsafe of PX4, has it"
            self.announcements.append((3, f"{text}; the next switch to offboard takes the mission up"))
            self._enter(time_s, Phase.ENGAGE)
        elif legs_done:
            self._enter(time_s, Phase.ENDING)
            self._ending(time_s, view, requests)

    def _ending(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        action, asking = ENDING_REQUESTS[self.ending], self._asking
        landed = view.vehicle is not None and not view.in_air and not view.armed
        mode_known = not self.silence.stale and not self.silence.just_ended(time_s)
        foreign = view.mode is not self._mode and view.mode not in ENDING_MODES[self.ending]
        if view.in_air and mode_known and foreign:
            self._taken(time_s, self._mode.value, view)
            return
        if not asking.accepted:
            # PX4 that refuses everything is left to its failsafe: that lands without a position too
            given_up = asking.refused.get(action, 0) >= REFUSALS
            self.streaming = self.in_offboard and not self.silence.stale and not given_up
            if asking.may_ask(time_s, RETRY_S):
                hold_first = bool(self._abort_reason) and RequestKind.HOLD not in asking.refused
                asking.ask(time_s, Request(RequestKind.HOLD if hold_first else action), requests)
        else:
            self.streaming = False
            self._offboard_since_s = None
            if action not in asking.accepted and asking.may_ask(time_s, 2.0 * RETRY_S):
                asking.ask(time_s, Request(action), requests)
            if action in asking.accepted and (self.ending is EndingAction.HOLD or landed):
                self._finish(time_s)
                return
        if landed and asking.refused.get(action, 0) >= REFUSALS:
            self._finish(time_s)
        elif time_s - self._entered_s > LANDING_TIMEOUT_S:
            self._abort(time_s, f"the ending ({self.ending.value}) was not finished within {LANDING_TIMEOUT_S:.0f} s")

    # ------------------------------------------------------------------ parts

    def _left_offboard(self, time_s: float, view: VehicleView) -> bool:
        if view.vehicle is None or self._offboard_since_s is None:
            return False
        if view.mode is FlightMode.OFFBOARD:
            self._mode_seen = True
            return False
        if self.silence.just_ended(time_s):
            return False  # PX4 comes back from its own failsafe when setpoints do
        return self._mode_seen or view.vehicle.time_s > self._offboard_since_s + HEARTBEAT_GRACE_S

    def _taken(self, time_s: float, left: str, view: VehicleView) -> None:
        """Somebody else has changed the mode: leave the vehicle to whoever it was."""
        self._abort(time_s, f"the vehicle left {left} for {view.mode.value}: the pilot, or a failsafe of PX4, has it")

    def _watch_telemetry(self, time_s: float, view: VehicleView) -> None:
        self.silence_ended = False
        if view.rebooted:
            self._rebooted(time_s)
        if self.phase not in (Phase.TAKEOFF, Phase.ENGAGE, Phase.LEGS, Phase.ENDING):
            self.silence = Silence(self.telemetry)
            return
        lasted, texts = self.silence.update(time_s, view.odometry_age_s(time_s), view.heartbeat_s, self.streaming)
        self.announcements += texts
        if lasted is not None and self.phase is Phase.LEGS:
            if lasted <= self.telemetry.resume_within_s:
                self.silence_ended = True
            else:
                ending = EndingAction.HOLD if self.engage is Engage.PILOT else None
                self.end(time_s, f"nothing was heard for {lasted:.0f} s", ending)
        if self.silence.lasts_s(time_s) > self.telemetry.give_up_s:
            self._abort(time_s, f"no telemetry for {self.telemetry.give_up_s:.0f} s")

    def _rebooted(self, time_s: float) -> None:
        """A vehicle that starts again in flight falls: there is nothing to send, and nobody to hand over to."""
        if self.phase is Phase.PREFLIGHT:
            self.announcements.append((4, "the vehicle has restarted"))
            self._enter(time_s, Phase.CONNECT)
        elif self.phase not in (Phase.CONNECT, Phase.DONE, Phase.ABORTED):
            self._abort(time_s, "the vehicle has restarted in flight")

    def _answered(self, time_s: float, result: RequestResult) -> None:
        if result.accepted:
            return
        text = f"{result.request.kind.value} was refused: {result.text}"
        if self.phase is not Phase.TAKEOFF:
            self.announcements.append((4, text))
        elif result.request.kind is RequestKind.ARM:
            self._abort(time_s, text)
        else:
            self.end(time_s, text)  # armed, and where the answer was lost perhaps flying

    def _enter(self, time_s: float, phase: Phase) -> None:
        self.phase, self._entered_s = phase, time_s
        self._ready_since_s = self._unready_since_s = None
        self._mode_seen = self.clearance.awaited = self.clearance.given = False
        self._asking.reset(time_s, RETRY_S)
        self.announcements.append((6, f"phase {phase.value}"))

    def _finish(self, time_s: float) -> None:
        reason = self._abort_reason
        self._enter(time_s, Phase.ABORTED if reason else Phase.DONE)
        self.reason = reason

    def _give_up(self, time_s: float, reason: str) -> None:
        self._abort(time_s, reason)
        self.clearance.awaited = self.clearance.needed  # it tells what else is wrong

    def _abort(self, time_s: float, reason: str) -> None:
        self.streaming = False
        self._offboard_since_s = None
        self._enter(time_s, Phase.ABORTED)
        self.reason = self._abort_reason or reason
        self.announcements.append((3, f"aborted: {reason}"))
