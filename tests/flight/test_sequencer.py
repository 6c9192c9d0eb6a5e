"""The phases of a flight, played through with a scripted vehicle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from uasfly.flight.choices import EndingAction, Engage
from uasfly.flight.clearance import Clearance
from uasfly.flight.sequencer import Sequencer
from uasfly.flight.view import VehicleView
from uasfly.messages import (
    FlightMode,
    LinkEvent,
    LinkSample,
    OdometrySample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    Sample,
    StateEstimate,
    VehicleSample,
)

PERIOD_S = 0.02
ZERO = np.zeros(3)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def _estimate(time_s: float, sigma_m: float = 0.01) -> StateEstimate:
    sigma = np.full(3, sigma_m)
    return StateEstimate(time_s, ZERO, ZERO, LEVEL, ZERO, ZERO, ZERO, sigma, sigma, sigma)


@dataclass
class Script:
    """A vehicle that does what it is asked, unless told otherwise, and a flight around it."""

    sequencer: Sequencer
    view: VehicleView = field(default_factory=VehicleView)
    time_s: float = 0.0
    mode: FlightMode = FlightMode.HOLD
    armed: bool = False
    in_air: bool = False
    silent: bool = False
    refuse: set[RequestKind] = field(default_factory=set)
    mute: set[RequestKind] = field(default_factory=set)
    legs_done: bool = False
    sigma_m: float = 0.01
    lands: bool = True
    asked: list[RequestKind] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    _queue: list[Sample] = field(default_factory=list)
    _airborne_at_s: float | None = None

    def phase(self) -> Phase:
        """The sequencer's; a type checker takes an attribute that was compared for unchanged, but not a call."""
        return self.sequencer.phase

    def run(self, seconds: float) -> None:
        """Let cycles pass."""
        for _ in range(round(seconds / PERIOD_S)):
            self.time_s += PERIOD_S
            samples, self._queue = self._queue, []
            if self._airborne_at_s is not None and self.time_s >= self._airborne_at_s:
                self.in_air, self.mode, self._airborne_at_s = True, FlightMode.HOLD, None
            if not self.silent:
                samples.append(OdometrySample(self.time_s, ZERO, ZERO, LEVEL, ZERO))
                samples.append(VehicleSample(self.time_s, self.mode, self.armed, self.in_air))
            self.view.update(tuple(samples))
            requests = self.sequencer.step(self.time_s, self.view, _estimate(self.time_s, self.sigma_m), self.legs_done)
            self.texts += [text for _, text in self.sequencer.announcements]
            self.sequencer.announcements.clear()
            for request in requests:
                self._answer(request)

    def _answer(self, request: Request) -> None:
        self.asked.append(request.kind)
        if request.kind in self.mute:
            return
        accepted = request.kind not in self.refuse
        self._queue.append(RequestResult(self.time_s, request, accepted, "" if accepted else "not now"))
        if not accepted:
            return
        match request.kind:
            case RequestKind.ARM:
                self.armed = True
            case RequestKind.TAKEOFF:
                self.mode, self._airborne_at_s = FlightMode.TAKEOFF, self.time_s + 3.0
            case RequestKind.OFFBOARD:
                self.mode = FlightMode.OFFBOARD
            case RequestKind.HOLD:
                self.mode = FlightMode.HOLD
            case RequestKind.LAND | RequestKind.RETURN:
                self.mode = FlightMode.LAND
                if self.lands:
                    self.armed = self.in_air = False
            case _:
                pass


def _script(engage: Engage = Engage.AUTO, ending: EndingAction = EndingAction.LAND) -> Script:
    return Script(Sequencer(engage, 1.5, ending))


def _checked(engage: Engage = Engage.AUTO, *, only_check: bool = False) -> Script:
    """A flight that has to be cleared."""
    clearance = Clearance(needed=True, only_check=only_check)
    return Script(Sequencer(engage, 1.5, EndingAction.LAND, clearance=clearance))


def test_nothing_is_armed_before_the_preflight_check_has_cleared_it() -> None:
    """It is awaited when all else is ready, not before; once cleared the flight goes on."""
    script = _checked()
    script.run(0.9)
    assert not script.sequencer.clearance.awaited
    script.run(20.0)
    assert script.sequencer.clearance.awaited
    assert (script.phase(), script.asked) == (Phase.PREFLIGHT, [])
    script.sequencer.clear(script.time_s, "")
    script.run(PERIOD_S)
    assert (script.phase(), script.asked) == (Phase.TAKEOFF, [RequestKind.ARM])
    assert not script.sequencer.clearance.awaited


def test_a_preflight_check_that_says_stop_arms_nothing() -> None:
    """The flight is over, and the reason is the check's."""
    script = _checked()
    script.run(2.0)
    script.sequencer.clear(script.time_s, "no battery")
    script.run(5.0)
    assert (script.phase(), script.sequencer.reason, script.asked) == (Phase.ABORTED, "no battery", [])
    assert not script.sequencer.hand_over


def test_a_mere_check_ends_when_it_is_cleared() -> None:
    """Nothing is armed after it either."""
    script = _checked(only_check=True)
    script.run(2.0)
    script.sequencer.clear(script.time_s, "")
    script.run(5.0)
    assert (script.phase(), script.sequencer.reason, script.asked) == (Phase.DONE, "", [])


def test_a_vehicle_that_becomes_unready_is_not_judged_meanwhile() -> None:
    """The check waits until it is ready again."""
    script = _checked()
    script.run(2.0)
    script.sigma_m = 9.0
    script.run(PERIOD_S)
    assert not script.sequencer.clearance.awaited
    script.sigma_m = 0.01
    script.run(1.5)
    assert script.sequencer.clearance.awaited


def test_a_vehicle_that_does_not_get_ready_is_judged_at_the_end() -> None:
    """The check tells what else is wrong; it changes nothing any more."""
    script = _checked()
    script.sigma_m = 9.0
    script.run(31.0)
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.clearance.awaited
    reason = script.sequencer.reason
    script.sequencer.clear(script.time_s, "much")
    assert (script.phase(), script.sequencer.reason) == (Phase.ABORTED, reason)
    assert not script.sequencer.clearance.awaited
    interrupted = _checked()
    interrupted.run(0.5)
    interrupted.sequencer.interrupt(interrupted.time_s, "Ctrl-C")
    assert not interrupted.sequencer.clearance.awaited


def test_every_take_off_of_the_pilot_is_cleared_anew() -> None:
    """After a landing the battery is another one."""
    script = _checked(Engage.PILOT)
    script.armed = script.in_air = True
    script.run(2.0)
    script.sequencer.clear(script.time_s, "")
    script.run(PERIOD_S)
    assert script.phase() is Phase.ENGAGE
    script.armed = script.in_air = False
    script.run(2.0)
    assert script.phase() is Phase.PREFLIGHT
    assert script.sequencer.clearance.awaited


def _in_legs(ending: EndingAction = EndingAction.LAND) -> Script:
    script = _script(ending=ending)
    script.run(12.0)
    assert script.phase() is Phase.LEGS
    return script


def test_an_undisturbed_flight_goes_through_every_phase() -> None:
    """Arm, take off, offboard, land, each asked once, and the flight is done."""
    script = _in_legs()
    script.legs_done = True
    script.run(3.0)
    assert script.phase() is Phase.DONE
    assert script.sequencer.reason == ""
    assert script.asked == [RequestKind.ARM, RequestKind.TAKEOFF, RequestKind.OFFBOARD, RequestKind.LAND]


def test_nothing_is_streamed_before_engaging_and_after_landing() -> None:
    """Setpoints flow in engage and legs only."""
    script = _script()
    streamed: dict[Phase, set[bool]] = {}
    for _ in range(1000):
        script.legs_done = script.time_s > 15.0
        script.run(PERIOD_S)
        streamed.setdefault(script.phase(), set()).add(script.sequencer.streaming)
    assert streamed[Phase.PREFLIGHT] == {False}
    assert streamed[Phase.TAKEOFF] == {False}
    assert True in streamed[Phase.LEGS]
    assert streamed[Phase.DONE] == {False}


@pytest.mark.parametrize(
    ("ending", "kind"), [(EndingAction.HOLD, RequestKind.HOLD), (EndingAction.RETURN, RequestKind.RETURN)]
)
def test_the_mission_says_how_it_ends(ending: EndingAction, kind: RequestKind) -> None:
    """The ending asks for hold or return instead of land."""
    script = _in_legs(ending)
    script.legs_done = True
    script.run(3.0)
    assert script.asked[-1] is kind
    assert script.phase() is Phase.DONE


def test_the_pilot_switching_away_has_the_vehicle_at_once() -> None:
    """A mode other than offboard: announced, nothing is asked, and the stream goes on only as an offer."""
    script = _in_legs()
    script.run(5.0)
    asked = len(script.asked)
    script.mode = FlightMode.POSITION
    script.run(0.1)
    assert script.phase() is Phase.ENGAGE
    assert script.sequencer.taken_over
    assert script.sequencer.pilot_flies
    assert not script.sequencer.in_offboard
    assert any("left offboard for position: the pilot" in text for text in script.texts)
    script.run(30.0)
    assert len(script.asked) == asked
    assert script.phase() is Phase.ENGAGE


@pytest.mark.parametrize("times", [1, 3])
def test_the_next_switch_to_offboard_takes_the_mission_up(times: int) -> None:
    """By the pilot, as often as wanted; uasfly itself does not ask for it."""
    script = _in_legs()
    script.run(2.0)
    for _ in range(times):
        script.mode = FlightMode.POSITION
        script.run(4.0)
        script.mode = FlightMode.OFFBOARD
        script.run(1.0)
        assert script.phase() is Phase.LEGS
        assert not script.sequencer.pilot_flies
        assert script.sequencer.in_offboard
        assert not script.sequencer.taken_over
    assert script.asked.count(RequestKind.OFFBOARD) == 1
    script.legs_done = True
    script.run(3.0)
    assert script.phase() is Phase.DONE


def test_a_vehicle_that_is_landed_by_whoever_took_it_ends_the_flight() -> None:
    """With uasfly in command of the take-off there is nobody to wait for."""
    script = _in_legs()
    script.mode = FlightMode.LAND
    script.run(3.0)
    script.armed = script.in_air = False
    script.run(0.1)
    assert script.phase() is Phase.ABORTED
    assert "taken over" in script.sequencer.reason
    assert not script.sequencer.hand_over


def test_ctrl_c_leaves_a_vehicle_alone_that_somebody_else_has() -> None:
    """No hold, no landing: it is the pilot's."""
    script = _in_legs()
    script.mode = FlightMode.POSITION
    script.run(1.0)
    asked = len(script.asked)
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(1.0)
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.hand_over
    assert len(script.asked) == asked


def test_refused_arming_aborts_with_the_vehicles_reason() -> None:
    """The reason names the command and what the vehicle said."""
    script = _script()
    script.refuse = {RequestKind.ARM}
    script.run(5.0)
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.reason == "arm was refused: not now"


def test_an_unanswered_take_off_aborts() -> None:
    """No answer within the time-out counts as refused."""
    script = _script()
    script.mute = {RequestKind.TAKEOFF}
    script.run(10.0)
    assert script.phase() is Phase.ABORTED
    assert "no answer" in script.sequencer.reason


def test_refused_offboard_is_asked_again_and_then_given_up() -> None:
    """Offboard is asked about once a second for ten seconds; then the flight is aborted and the vehicle holds."""
    script = _script()
    script.refuse = {RequestKind.OFFBOARD}
    script.run(25.0)
    assert 5 <= script.asked.count(RequestKind.OFFBOARD) <= 11
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.streaming


def test_an_uncertain_estimate_does_not_take_off() -> None:
    """A velocity sigma of 2 m/s is not ready to fly; after the time-out the reason says so."""
    script = _script()
    script.sigma_m = 2.0
    script.run(35.0)
    assert script.phase() is Phase.ABORTED
    assert "velocity is known to 2.00 m/s" in script.sequencer.reason
    assert script.asked == []


def test_stale_telemetry_stops_the_setpoints_and_fresh_telemetry_brings_them_back() -> None:
    """Older than 0.2 s: no setpoints, announced; back: setpoints, announced, and the mission is taken up."""
    script = _in_legs()
    script.silent = True
    script.run(0.18)
    assert script.sequencer.streaming
    script.run(0.1)
    assert not script.sequencer.streaming
    script.silent = False
    script.run(PERIOD_S)
    assert script.sequencer.streaming
    assert script.sequencer.silence_ended
    assert script.phase() is Phase.LEGS
    assert any("telemetry is 0.2 s old" in text for text in script.texts)
    assert any("telemetry is back after 0." in text for text in script.texts)
    script.run(PERIOD_S)
    assert not script.sequencer.silence_ended


def test_px4_in_its_failsafe_after_a_silence_is_no_pilot() -> None:
    """Two seconds of silence: PX4 holds by itself and comes back when setpoints do; whoever stays away has taken it."""
    script = _in_legs()
    script.silent = True
    script.run(2.0)
    script.silent, script.mode = False, FlightMode.HOLD
    script.run(1.0)
    assert script.phase() is Phase.LEGS
    assert script.sequencer.streaming
    script.mode = FlightMode.OFFBOARD
    script.run(2.0)
    assert script.phase() is Phase.LEGS
    script.silent = True
    script.run(2.0)
    script.silent, script.mode = False, FlightMode.HOLD
    script.run(3.0)
    assert script.sequencer.taken_over


def test_a_long_silence_ends_the_mission() -> None:
    """After ten seconds nobody knows what the vehicle has done: hold, then the ending."""
    script = _in_legs()
    script.silent = True
    script.run(10.0)
    assert script.phase() is Phase.LEGS
    assert not script.sequencer.streaming
    script.silent, script.mode = False, FlightMode.HOLD
    script.run(5.0)
    assert script.asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.reason == "nothing was heard for 10 s"
    assert any("link lost" in text for text in script.texts)
    assert "link is back" in script.texts


@pytest.mark.parametrize("stood_s", [0.3, 3.0])
def test_a_cycle_that_stood_still_is_a_silence_too(stood_s: float) -> None:
    """The process was stopped: it is said, and the mission is taken up from where the vehicle is by then."""
    script = _in_legs()
    script.time_s += stood_s
    script.run(PERIOD_S)
    assert script.sequencer.silence_ended
    assert script.sequencer.streaming
    assert any(f"stood still for {stood_s:.1f} s" in text for text in script.texts)


def test_a_vehicle_that_restarts_in_flight_ends_it() -> None:
    """Motors off: nothing more is sent, nothing is asked, and nobody is handed anything."""
    script = _in_legs()
    script.view.update((LinkSample(script.time_s, LinkEvent.REBOOTED),))
    script.sequencer.step(script.time_s + PERIOD_S, script.view, _estimate(script.time_s), False)
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.reason == "the vehicle has restarted in flight"
    assert not script.sequencer.streaming
    assert not script.sequencer.hand_over


def test_lost_telemetry_aborts() -> None:
    """A minute of silence ends the flight; PX4's own failsafe has had the vehicle all the while."""
    script = _in_legs()
    script.silent = True
    script.run(59.0)
    assert script.phase() is Phase.LEGS
    script.run(3.0)
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.streaming


def test_one_interrupt_holds_and_then_lands() -> None:
    """Ctrl-C once: hold, then the mission's ending; the outcome is aborted with that reason."""
    script = _in_legs()
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(0.1)
    assert script.asked[-1] is RequestKind.HOLD
    assert script.sequencer.reason == "stopped by Ctrl-C"  # known from now on, not only at the end
    script.run(5.0)
    assert script.asked[-1:] == [RequestKind.LAND]
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.reason == "stopped by Ctrl-C"
    assert not script.sequencer.hand_over


def test_two_interrupts_hand_over_at_once() -> None:
    """Ctrl-C twice: the stream stops in that moment and the driver is told to ask for hold."""
    script = _in_legs()
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.streaming
    assert script.sequencer.hand_over


def test_engage_by_pilot_asks_for_nothing_and_waits_for_offboard() -> None:
    """The pilot arms, takes off and switches; uasfly streams once it flies and flies once it is offboard."""
    script = _script(Engage.PILOT)
    script.run(5.0)
    assert script.asked == []
    script.armed = script.in_air = True
    script.run(20.0)
    assert script.phase() is Phase.ENGAGE
    assert script.sequencer.streaming
    assert script.sequencer.pilot_flies
    script.mode = FlightMode.OFFBOARD
    script.run(0.1)
    assert script.phase() is Phase.LEGS
    assert script.asked == []


def test_a_vehicle_that_flies_already_is_not_asked_to_take_off() -> None:
    """Armed and in the air: straight to engage."""
    script = _script()
    script.armed = script.in_air = True
    script.run(5.0)
    assert script.asked == [RequestKind.OFFBOARD]
    assert script.phase() is Phase.LEGS


def test_silence_from_the_start_ends_with_what_was_missing() -> None:
    """No heartbeat within 15 s: aborted, and the reason says what did not come."""
    script = _script()
    script.silent = True
    script.run(16.0)
    assert script.phase() is Phase.ABORTED
    assert "no heartbeat" in script.sequencer.reason


def test_the_pilot_leaving_offboard_is_noticed_at_once_when_offboard_has_been_seen() -> None:
    """The grace is for a heartbeat that is late, not for a pilot who is quick."""
    script = _in_legs()
    script.mode = FlightMode.POSITION
    script.run(PERIOD_S)
    assert script.sequencer.taken_over
    assert any("left offboard for position" in text for text in script.texts)


def test_an_old_heartbeat_after_the_mode_change_is_no_take_over() -> None:
    """Offboard accepted, but the last heartbeat still tells hold: the legs fly on, and wait when hold stays."""
    script = _script()
    script.run(5.0)
    while script.phase() is not Phase.LEGS:
        script.run(PERIOD_S)
        if script.mode is FlightMode.OFFBOARD:
            script.mode = FlightMode.HOLD
    script.run(1.0)
    assert script.phase() is Phase.LEGS
    script.run(1.0)
    assert script.sequencer.taken_over
    assert any("left offboard for hold" in text for text in script.texts)


def test_a_mode_change_while_engaging_is_the_pilots() -> None:
    """Position mode after take-off: offboard is not asked for, and nothing else."""
    script = _script()
    while script.phase() is not Phase.ENGAGE:
        script.run(PERIOD_S)
    script.mode = FlightMode.POSITION
    script.run(3.0)
    assert script.phase() is Phase.ABORTED
    assert "left hold for position" in script.sequencer.reason
    assert script.asked == [RequestKind.ARM, RequestKind.TAKEOFF]


def test_a_mode_change_during_take_off_is_the_pilots() -> None:
    """Return instead of take-off: aborted at once instead of waiting for a hold that is not ours."""
    script = _script()
    script.run(2.0)
    assert script.mode is FlightMode.TAKEOFF
    script.mode = FlightMode.RETURN
    script.run(PERIOD_S)
    assert script.phase() is Phase.ABORTED
    assert "left take-off for return" in script.sequencer.reason


@pytest.mark.parametrize("refuse", [{RequestKind.LAND}, {RequestKind.HOLD, RequestKind.LAND}, set[RequestKind]()])
@pytest.mark.parametrize("interrupted", [False, True])
def test_a_mode_change_while_ending_is_the_pilots(refuse: set[RequestKind], interrupted: bool) -> None:
    """Before or after hold or land was accepted: the pilot's position mode stops both setpoints and requests."""
    script = _in_legs()
    script.run(1.0)
    script.lands, script.refuse = False, refuse
    script.legs_done = not interrupted
    if interrupted:
        script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(0.1)
    script.mode = FlightMode.POSITION
    asked = len(script.asked)
    script.run(5.0)
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.streaming
    assert len(script.asked) == asked


def test_a_vehicle_that_disarms_in_the_legs_ends_the_flight() -> None:
    """A kill switch or a crash does not count as a completed mission."""
    script = _in_legs()
    script.armed = False
    script.run(0.1)
    assert script.phase() is Phase.ABORTED
    assert "disarmed" in script.sequencer.reason


def test_refused_hold_goes_on_to_the_ending() -> None:
    """Without a position PX4 refuses hold: after the interrupt landing is asked for, and setpoints flow until then."""
    script = _in_legs()
    script.refuse = {RequestKind.HOLD}
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(0.5)
    assert script.sequencer.streaming
    script.run(3.0)
    assert script.asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.reason == "stopped by Ctrl-C"


def test_a_vehicle_that_was_taken_off_is_not_left_hovering() -> None:
    """Refused offboard: after the time-out hold and landing are asked for."""
    script = _script()
    script.refuse = {RequestKind.OFFBOARD}
    script.run(25.0)
    assert script.asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]
    assert not script.armed


def test_an_interrupt_leaves_a_vehicle_that_the_pilot_flies_alone() -> None:
    """Engage by pilot, still waiting for the switch: Ctrl-C asks for nothing and hands nothing over."""
    script = _script(Engage.PILOT)
    script.armed = script.in_air = True
    script.run(5.0)
    assert script.phase() is Phase.ENGAGE
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(1.0)
    assert script.phase() is Phase.ABORTED
    assert script.asked == []
    assert not script.sequencer.hand_over


def test_a_pilot_who_lands_again_is_waited_for_anew() -> None:
    """On the ground nothing is streamed, and offboard there does not start the legs."""
    script = _script(Engage.PILOT)
    script.armed = script.in_air = True
    script.run(5.0)
    script.armed = script.in_air = False
    script.mode = FlightMode.OFFBOARD
    script.run(1.0)
    assert script.phase() is Phase.PREFLIGHT
    assert not script.sequencer.streaming


def test_a_short_uncertainty_after_a_long_wait_is_forgiven() -> None:
    """A pilot may wait for minutes: only half a minute without being ready in a row ends the flight."""
    script = _script(Engage.PILOT)
    script.run(60.0)
    script.sigma_m = 2.0
    script.run(5.0)
    assert script.phase() is Phase.PREFLIGHT
    script.sigma_m = 0.01
    script.run(5.0)
    script.sigma_m = 2.0
    script.run(28.0)
    assert script.phase() is Phase.PREFLIGHT
    script.run(3.0)
    assert script.phase() is Phase.ABORTED


def test_an_interrupt_while_ending_is_answered() -> None:
    """The first Ctrl-C during the landing changes nothing and says so; the second leaves the landing to PX4."""
    script = _in_legs()
    script.lands, script.legs_done = False, True
    script.run(0.1)
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    script.run(0.1)
    assert script.phase() is Phase.ENDING
    assert any("once more hands over" in text for text in script.texts)
    script.sequencer.interrupt(script.time_s, "stopped by Ctrl-C")
    assert script.phase() is Phase.ABORTED
    assert not script.sequencer.hand_over


@pytest.mark.parametrize(("seconds", "hand_over"), [(0.5, False), (3.0, True), (12.0, True)])
def test_leaving_hands_over_what_uasfly_flies(seconds: float, hand_over: bool) -> None:
    """An error on the ground leaves nothing to hold; after take-off the driver must ask for hold."""
    script = _script()
    script.run(seconds)
    script.sequencer.leave(script.time_s, "a bug")
    assert script.phase() is Phase.ABORTED
    assert script.sequencer.hand_over is hand_over
    assert script.sequencer.reason == "a bug"


def test_odometry_from_the_future_is_stale() -> None:
    """A wrong clock stops the setpoints as silence does, and one wrong stamp costs no more than its own time."""
    script = _in_legs()
    script.silent = True
    script.view.update((OdometrySample(script.time_s + 1000.0, ZERO, ZERO, LEVEL, ZERO),))
    script.run(0.1)
    assert not script.sequencer.streaming
    script.silent = False
    script.run(0.1)
    assert script.sequencer.streaming
    assert script.phase() is Phase.LEGS
