"""The phases of a flight: connect, preflight, take-off, engage, legs, ending (sans-I/O, no clock of its own).

The pilot's switch always wins: when the vehicle changes its mode without having been asked to, or is being flown by the
pilot, nothing more is sent and nothing is asked.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from uasfly.flight.view import VehicleView
from uasfly.messages import FlightMode, Phase, Request, RequestKind, RequestResult, StateEstimate

PREFLIGHT_TIMEOUT_S = 30.0
TAKEOFF_TIMEOUT_S = 60.0
READY_S = 1.0  # readiness counts when it lasts
SETTLE_S = 4.0  # in hold after take-off: the wind force is learned here
STREAM_BEFORE_OFFBOARD_S = 0.6  # PX4 wants a stream before it enters offboard
ENGAGE_TIMEOUT_S = 10.0
RETRY_S = 1.0
ANSWER_TIMEOUT_S = 5.0
LANDING_TIMEOUT_S = 240.0
STALE_S = 0.5  # older odometry than this stops the setpoints; PX4's own failsafe acts after COM_OF_LOSS_T
LOST_S = 5.0
VELOCITY_SIGMA_READY_M_S = 0.2
POSITION_SIGMA_READY_M = 5.0  # GNSS drifts unseen while the vehicle waits on the ground, so this one cannot be tight
HEARTBEAT_GRACE_S = 1.5  # a heartbeat that tells the old mode may still be on its way after an accepted change
DISCONNECT_S = 15.0


class Engage(Enum):
    """Who arms, takes off and switches to offboard: uasfly, or the pilot with the remote control."""

    AUTO = "auto"
    PILOT = "pilot"


class EndingAction(Enum):
    """How a mission ends."""

    LAND = "land"
    HOLD = "hold"
    RETURN = "return"


_ENDING_REQUESTS = {
    EndingAction.LAND: RequestKind.LAND,
    EndingAction.HOLD: RequestKind.HOLD,
    EndingAction.RETURN: RequestKind.RETURN,
}
_BEFORE_ENDING = frozenset({FlightMode.TAKEOFF, FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.DESCEND})
_ENDING_MODES = {
    EndingAction.LAND: _BEFORE_ENDING | {FlightMode.LAND},
    EndingAction.HOLD: _BEFORE_ENDING,
    EndingAction.RETURN: _BEFORE_ENDING | {FlightMode.RETURN, FlightMode.LAND},
}


@dataclass(slots=True)
class Sequencer:
    """State machine of a flight.

    Attributes:
        engage: who brings the vehicle into offboard.
        takeoff_height_m: height above ground of the take-off.
        ending: what follows the legs.
        phase, reason: where the flight is, and why it ended early.
        streaming: whether setpoints are to be sent in this step.
        hand_over: uasfly leaves a vehicle that it was flying: the driver's last request must be hold.
        announcements: new texts with their MAVLink severity, cleared by the reader.
    """

    engage: Engage
    takeoff_height_m: float
    ending: EndingAction
    phase: Phase = Phase.CONNECT
    reason: str = ""
    streaming: bool = False
    hand_over: bool = False
    announcements: list[tuple[int, str]] = field(default_factory=list)
    _entered_s: float = 0.0
    _asked: Request | None = None
    _asked_s: float = 0.0
    _accepted: set[RequestKind] = field(default_factory=set)
    _offboard_since_s: float | None = None
    _ready_since_s: float | None = None
    _unready_since_s: float | None = None
    _mode: FlightMode = FlightMode.OTHER  # at the last step, or when the phase began
    _mode_seen: bool = False  # the mode that this phase asks for has been reported
    _hold_refused: bool = False
    _stale: bool = False
    _interrupts: int = 0
    _abort_reason: str = ""

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
        for result in view.results:
            self._answered(time_s, result)
        if self._asked is not None and time_s - self._asked_s > ANSWER_TIMEOUT_S:
            self._answered(time_s, RequestResult(time_s, self._asked, accepted=False, text="no answer"))
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

    def end(self, time_s: float, reason: str) -> None:
        """Leave the mission early: hold, then its ending; the outcome is "aborted" with this reason."""
        if self.phase in (Phase.ENDING, Phase.DONE, Phase.ABORTED):
            return
        if not self._flies:
            self._abort(time_s, reason)
            return
        self._abort_reason = self._abort_reason or reason
        self.announcements.append((4, f"{reason}: holding, then {self.ending.value}"))
        self._enter(time_s, Phase.ENDING)

    def leave(self, time_s: float, reason: str) -> None:
        """Stop at once: no more setpoints; `hand_over` where the vehicle would be left without anybody."""
        if self.phase in (Phase.DONE, Phase.ABORTED):
            return
        ends_by_itself = self.phase is Phase.ENDING and _ENDING_REQUESTS[self.ending] in self._accepted
        self.hand_over = self._flies and not ends_by_itself
        self._abort(time_s, reason)

    @property
    def in_offboard(self) -> bool:
        """Whether uasfly's setpoints are what flies the vehicle."""
        return self._offboard_since_s is not None

    @property
    def _flies(self) -> bool:
        """Whether uasfly is in command, rather than nobody yet or the pilot."""
        if self.phase is Phase.ENGAGE:
            return self.engage is Engage.AUTO
        return self.phase in (Phase.TAKEOFF, Phase.LEGS, Phase.ENDING)

    # ------------------------------------------------------------------ phases

    def _connect(self, time_s: float, view: VehicleView, estimate: StateEstimate | None) -> None:
        if self._entered_s == 0.0:
            self._entered_s = time_s
        if estimate is not None and view.vehicle is not None:
            self._enter(time_s, Phase.PREFLIGHT)
        elif time_s - self._entered_s > DISCONNECT_S:
            missing = "heartbeat" if view.vehicle is None else "ODOMETRY"
            self._abort(time_s, f"no {missing} from the vehicle within {DISCONNECT_S:.0f} s")

    def _preflight(
        self, time_s: float, view: VehicleView, estimate: StateEstimate | None, requests: list[Request]
    ) -> None:
        ready = (
            estimate is not None
            and float(estimate.velocity_sigma_m_s.max()) < VELOCITY_SIGMA_READY_M_S
            and float(estimate.position_sigma_m.max()) < POSITION_SIGMA_READY_M
            and (view.health is None or (view.health.attitude_ok and view.health.velocity_ok))
        )
        if not ready:
            self._ready_since_s = None
            if self._unready_since_s is None:
                self._unready_since_s = time_s
            if time_s - self._unready_since_s > PREFLIGHT_TIMEOUT_S:
                self._abort(time_s, f"not ready to fly after {PREFLIGHT_TIMEOUT_S:.0f} s: {_unready(view, estimate)}")
            return
        if self._ready_since_s is None:
            self._ready_since_s = time_s
        if time_s - self._ready_since_s < READY_S:
            return
        self._unready_since_s = None  # in pilot mode the wait may be long: only time in a row counts
        if view.armed and view.in_air:
            self._enter(time_s, Phase.ENGAGE)
        elif self.engage is Engage.AUTO:
            self._enter(time_s, Phase.TAKEOFF)
            self._ask(time_s, Request(RequestKind.ARM), requests)

    def _takeoff(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        if RequestKind.ARM in self._accepted and RequestKind.TAKEOFF not in self._accepted and self._asked is None:
            self._ask(time_s, Request(RequestKind.TAKEOFF, self.takeoff_height_m), requests)
        self._mode_seen |= view.mode is FlightMode.TAKEOFF
        if self._mode_seen and view.mode not in (FlightMode.TAKEOFF, FlightMode.HOLD):
            self._taken(time_s, "take-off", view)
        elif RequestKind.TAKEOFF in self._accepted and view.in_air and view.mode is FlightMode.HOLD:
            if self._ready_since_s is None:
                self._ready_since_s = time_s
            if time_s - self._ready_since_s >= SETTLE_S:
                self._enter(time_s, Phase.ENGAGE)
        elif time_s - self._entered_s > TAKEOFF_TIMEOUT_S:
            self.end(time_s, f"take-off not finished within {TAKEOFF_TIMEOUT_S:.0f} s")

    def _engage(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        self.streaming = not self._stale
        if self.engage is Engage.PILOT and not (view.armed and view.in_air):
            self.streaming = False
            self._enter(time_s, Phase.PREFLIGHT)  # the pilot has landed again
            return
        if view.mode is FlightMode.OFFBOARD or RequestKind.OFFBOARD in self._accepted:
            self._offboard_since_s = time_s
            self._enter(time_s, Phase.LEGS)
            return
        if self.engage is Engage.PILOT:
            return
        waited = time_s - self._entered_s
        if not view.armed:
            self._abort(time_s, "the vehicle has disarmed")
        elif view.mode is not self._mode and (self._mode, view.mode) != (FlightMode.TAKEOFF, FlightMode.HOLD):
            self._taken(time_s, self._mode.value, view)
        elif waited > ENGAGE_TIMEOUT_S:
            self.end(time_s, f"the vehicle did not enter offboard within {ENGAGE_TIMEOUT_S:.0f} s")
        elif waited > STREAM_BEFORE_OFFBOARD_S and self._asked is None and time_s - self._asked_s > RETRY_S:
            self._ask(time_s, Request(RequestKind.OFFBOARD), requests)

    def _legs(self, time_s: float, view: VehicleView, legs_done: bool, requests: list[Request]) -> None:
        self.streaming = not self._stale
        if not view.armed:
            self._abort(time_s, "the vehicle has disarmed in flight")
        elif self._left_offboard(view):
            self._taken(time_s, "offboard", view)
        elif legs_done:
            self._enter(time_s, Phase.ENDING)
            self._ending(time_s, view, requests)

    def _ending(self, time_s: float, view: VehicleView, requests: list[Request]) -> None:
        action = _ENDING_REQUESTS[self.ending]
        landed = view.vehicle is not None and not view.in_air and not view.armed
        if view.in_air and view.mode is not self._mode and view.mode not in _ENDING_MODES[self.ending]:
            self._taken(time_s, self._mode.value, view)
            return
        if not self._accepted:
            self.streaming = self.in_offboard and not self._stale
            if self._asked is None and time_s - self._asked_s > RETRY_S:
                first = RequestKind.HOLD if self._abort_reason and not self._hold_refused else action
                self._ask(time_s, Request(first), requests)
        else:
            self.streaming = False
            self._offboard_since_s = None
            if action not in self._accepted and self._asked is None and time_s - self._asked_s > 2.0 * RETRY_S:
                self._ask(time_s, Request(action), requests)
            if action in self._accepted and (self.ending is EndingAction.HOLD or landed):
                self._finish(time_s)
                return
        if time_s - self._entered_s > LANDING_TIMEOUT_S:
            self._abort(time_s, f"the ending ({self.ending.value}) was not finished within {LANDING_TIMEOUT_S:.0f} s")

    # ------------------------------------------------------------------ parts

    def _left_offboard(self, view: VehicleView) -> bool:
        if view.vehicle is None or self._offboard_since_s is None or self._stale:
            return False
        if view.mode is FlightMode.OFFBOARD:
            self._mode_seen = True
            return False
        return self._mode_seen or view.vehicle.time_s > self._offboard_since_s + HEARTBEAT_GRACE_S

    def _taken(self, time_s: float, left: str, view: VehicleView) -> None:
        """Somebody else has changed the mode: leave the vehicle to whoever it was."""
        self._abort(time_s, f"the vehicle left {left} for {view.mode.value}: the pilot, or a failsafe of PX4, has it")

    def _watch_telemetry(self, time_s: float, view: VehicleView) -> None:
        if self.phase not in (Phase.ENGAGE, Phase.LEGS, Phase.ENDING):
            return
        age = view.odometry_age_s(time_s)
        if not age <= STALE_S and not self._stale:
            self._stale = True
            self.announcements.append((3, f"telemetry is {age:.1f} s old: no setpoints until it is back"))
        elif age <= STALE_S and self._stale:
            self._stale = False
            self.announcements.append((4, "telemetry is back"))
        if age > LOST_S and self.phase is not Phase.ENDING:
            self._abort(time_s, f"no telemetry for {LOST_S:.0f} s")

    def _ask(self, time_s: float, request: Request, requests: list[Request]) -> None:
        self._asked, self._asked_s = request, time_s
        requests.append(request)

    def _answered(self, time_s: float, result: RequestResult) -> None:
        if self._asked is None or result.request.kind is not self._asked.kind:
            return
        self._asked = None
        if result.accepted:
            self._accepted.add(result.request.kind)
            return
        text = f"{result.request.kind.value} was refused: {result.text}"
        if self.phase is not Phase.TAKEOFF:
            self._hold_refused = self.phase is Phase.ENDING and result.request.kind is RequestKind.HOLD
            self.announcements.append((4, text))
        elif result.request.kind is RequestKind.ARM:
            self._abort(time_s, text)
        else:
            self.end(time_s, text)  # armed, and where the answer was lost perhaps flying

    def _enter(self, time_s: float, phase: Phase) -> None:
        self.phase, self._entered_s = phase, time_s
        self._asked, self._ready_since_s, self._unready_since_s = None, None, None
        self._mode_seen = self._hold_refused = False
        self._asked_s = time_s - RETRY_S
        self._accepted.clear()
        self.announcements.append((6, f"phase {phase.value}"))

    def _finish(self, time_s: float) -> None:
        reason = self._abort_reason
        self._enter(time_s, Phase.ABORTED if reason else Phase.DONE)
        self.reason = reason

    def _abort(self, time_s: float, reason: str) -> None:
        self.streaming = False
        self._offboard_since_s = None
        self._enter(time_s, Phase.ABORTED)
        self.reason = self._abort_reason or reason
        self.announcements.append((3, f"aborted: {reason}"))


def _unready(view: VehicleView, estimate: StateEstimate | None) -> str:
    """Why the vehicle is not ready, for the pilot."""
    if view.health is not None and not (view.health.attitude_ok and view.health.velocity_ok):
        return "PX4's estimator reports no attitude or velocity"
    if estimate is None:
        return "no estimate"
    velocity, position = float(estimate.velocity_sigma_m_s.max()), float(estimate.position_sigma_m.max())
    return f"velocity is known to {velocity:.2f} m/s, position to {position:.2f} m"
