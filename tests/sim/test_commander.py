from __future__ import annotations

import math
from dataclasses import replace

import pytest

from uasfly.messages import FlightMode
from uasfly.sim.commander import Commander
from uasfly.sim.failsafe import Situation
from uasfly.sim.parameters import ParameterTable

READY = Situation(5.0, math.inf, True, 0.9, True)
FLYING = replace(READY, now_s=20.0, landed=False)
STREAM = 0.05


def commander(**changes: float) -> Commander:
    """A commander that has booted."""
    booted = Commander(ParameterTable(changes))
    booted.update(READY, False)
    return booted


def flying(mode: FlightMode = FlightMode.HOLD, **changes: float) -> Commander:
    """A commander in flight, in hold or in offboard with a fresh stream."""
    pilot = commander(**changes)
    assert pilot.arm(READY) == (True, "")
    pilot.update(FLYING, False)
    age = STREAM if mode is FlightMode.OFFBOARD else math.inf
    assert pilot.set_mode(mode, replace(FLYING, setpoint_age_s=age)) == (True, "")
    pilot.take_texts()
    return pilot


def mode_of(pilot: Commander) -> FlightMode:
    """What flies now; a type checker takes an attribute that was compared for unchanged, but not a call."""
    return pilot.mode


def texts(pilot: Commander) -> list[tuple[int, str]]:
    """Severity and words since the last call."""
    return [(text.severity, text.text) for text in pilot.take_texts()]


def test_arming_is_announced_and_denied_while_not_ready() -> None:
    """Arming needs a vehicle that has started and knows where it is; PX4's words say so."""
    pilot = Commander(ParameterTable())
    denied = (False, "Arming denied: Resolve system health failures first")
    assert pilot.arm(replace(READY, now_s=1.0)) == denied
    assert pilot.arm(replace(READY, position_ok=False)) == denied
    assert pilot.arm(replace(READY, battery_remaining=0.05)) == denied
    pilot.refuse_arming = True
    assert pilot.arm(READY) == denied
    pilot.refuse_arming = False
    assert not pilot.armed
    pilot.take_texts()
    pilot.update(READY, False)
    assert pilot.arm(READY) == (True, "")
    assert texts(pilot) == [(6, "Ready for takeoff!"), (6, "Armed by external command")]


@pytest.mark.parametrize("mode", [FlightMode.LAND, FlightMode.RETURN, FlightMode.DESCEND])
def test_modes_that_only_end_a_flight_prevent_arming(mode: FlightMode) -> None:
    """Nobody arms in land, return or descend."""
    pilot = commander()
    assert pilot.set_mode(mode, READY)[0]
    assert not pilot.arm(READY)[0]


def test_offboard_on_the_ground_is_taken_without_a_stream_but_does_not_arm() -> None:
    """Disarmed any mode is taken; arming in offboard needs the stream."""
    pilot = commander()
    assert pilot.set_mode(FlightMode.OFFBOARD, READY) == (True, "")
    assert mode_of(pilot) is FlightMode.OFFBOARD
    assert not pilot.arm(READY)[0]
    assert pilot.arm(replace(READY, setpoint_age_s=STREAM))[0]


def test_offboard_in_flight_needs_a_fresh_stream() -> None:
    """In flight offboard is refused without a setpoint in the last second, and taken with one."""
    pilot = flying()
    refused, said = pilot.set_mode(FlightMode.OFFBOARD, replace(FLYING, setpoint_age_s=1.1))
    assert (refused, said) == (False, "Switching to Offboard is currently not available")
    assert mode_of(pilot) is FlightMode.HOLD
    assert pilot.set_mode(FlightMode.OFFBOARD, replace(FLYING, setpoint_age_s=0.9))[0]
    assert mode_of(pilot) is FlightMode.OFFBOARD


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, FlightMode.RETURN),
        (1, FlightMode.RETURN),
        (3, FlightMode.RETURN),
        (4, FlightMode.LAND),
        (5, FlightMode.HOLD),
    ],
)
def test_loss_of_the_stream_acts_and_its_return_leads_back(action: int, mode: FlightMode) -> None:
    """After COM_OF_LOSS_T the action of COM_OBL_RC_ACT flies; position is return without remote control."""
    pilot = flying(FlightMode.OFFBOARD, COM_OBL_RC_ACT=action)
    pilot.update(replace(FLYING, setpoint_age_s=0.99), False)
    assert mode_of(pilot) is FlightMode.OFFBOARD
    pilot.update(replace(FLYING, setpoint_age_s=1.01), False)
    assert mode_of(pilot) is mode
    assert pilot.failsafe
    pilot.update(replace(FLYING, setpoint_age_s=3.0), False)
    assert texts(pilot) == [(2, "Failsafe activated")]
    pilot.update(replace(FLYING, setpoint_age_s=STREAM), False)
    assert mode_of(pilot) is FlightMode.OFFBOARD
    assert not pilot.failsafe


def test_the_loss_time_is_a_parameter() -> None:
    """COM_OF_LOSS_T moves the limit."""
    pilot = flying(FlightMode.OFFBOARD, COM_OF_LOSS_T=0.3)
    pilot.update(replace(FLYING, setpoint_age_s=0.4), False)
    assert mode_of(pilot) is FlightMode.HOLD


def test_loss_may_disarm() -> None:
    """COM_OBL_RC_ACT 7 switches the motors off, even in the air."""
    pilot = flying(FlightMode.OFFBOARD, COM_OBL_RC_ACT=7)
    pilot.update(replace(FLYING, setpoint_age_s=1.1), False)
    assert not pilot.armed
    assert texts(pilot) == [(6, "Disarmed by failsafe")]


def test_a_pilot_who_switches_away_stays_away() -> None:
    """After hold was asked for, a stream alone does not bring offboard back."""
    pilot = flying(FlightMode.OFFBOARD)
    pilot.update(replace(FLYING, setpoint_age_s=2.0), False)
    assert pilot.set_mode(FlightMode.HOLD, replace(FLYING, setpoint_age_s=2.0))[0]
    pilot.update(replace(FLYING, setpoint_age_s=STREAM), False)
    assert mode_of(pilot) is FlightMode.HOLD


def test_a_finished_take_off_becomes_hold() -> None:
    """Take-off turns into hold by itself."""
    pilot = flying()
    assert pilot.set_mode(FlightMode.TAKEOFF, FLYING)[0]
    pilot.update(FLYING, False)
    assert mode_of(pilot) is FlightMode.TAKEOFF
    pilot.update(FLYING, True)
    assert mode_of(pilot) is FlightMode.HOLD
    assert not pilot.failsafe


def test_without_a_position_hold_becomes_descend_and_offboard_goes_on() -> None:
    """Losing the position ends every mode that needs one; attitude setpoints need none."""
    blind = replace(FLYING, position_ok=False)
    pilot = flying()
    pilot.update(blind, False)
    assert mode_of(pilot) is FlightMode.DESCEND
    assert not pilot.set_mode(FlightMode.RETURN, blind)[0]
    pilot.update(FLYING, False)
    assert mode_of(pilot) is FlightMode.HOLD
    offboard = flying(FlightMode.OFFBOARD)
    offboard.update(replace(blind, setpoint_age_s=STREAM), False)
    assert mode_of(offboard) is FlightMode.OFFBOARD
    offboard.update(replace(blind, setpoint_age_s=2.0), False)
    assert mode_of(offboard) is FlightMode.DESCEND


def test_a_low_battery_warns_holds_and_returns() -> None:
    """Low warns; critical holds for COM_FAIL_ACT_T and returns; emergency lands."""
    pilot = flying()
    pilot.update(replace(FLYING, battery_remaining=0.14), False)
    assert mode_of(pilot) is FlightMode.HOLD
    pilot.update(replace(FLYING, now_s=30.0, battery_remaining=0.06), False)
    assert (pilot.mode, pilot.failsafe) == (FlightMode.HOLD, True)
    pilot.update(replace(FLYING, now_s=35.1, battery_remaining=0.06), False)
    assert mode_of(pilot) is FlightMode.RETURN
    pilot.update(replace(FLYING, now_s=40.0, battery_remaining=0.04), False)
    pilot.update(replace(FLYING, now_s=45.1, battery_remaining=0.04), False)
    assert mode_of(pilot) is FlightMode.LAND
    said = texts(pilot)
    assert [text for _, text in said] == [
        "Low battery level, return advised",
        "Critical battery level, land now",
        "Failsafe activated",
        "Emergency battery level, land immediately",
    ]
    assert [severity for severity, _ in said] == [4, 2, 2, 0]


def test_a_pilot_may_overrule_the_battery() -> None:
    """A mode chosen while the battery's failsafe acts is flown; the next warning acts again."""
    pilot = flying()
    low = replace(FLYING, battery_remaining=0.06)
    pilot.update(low, False)
    pilot.update(replace(low, now_s=26.0), False)
    assert mode_of(pilot) is FlightMode.RETURN
    assert pilot.set_mode(FlightMode.HOLD, replace(low, now_s=27.0))[0]
    pilot.update(replace(low, now_s=40.0), False)
    assert (pilot.mode, pilot.failsafe) == (FlightMode.HOLD, False)
    pilot.update(replace(low, now_s=41.0, battery_remaining=0.04), False)
    pilot.update(replace(low, now_s=47.0, battery_remaining=0.04), False)
    assert mode_of(pilot) is FlightMode.LAND


def test_disarming_in_the_air_is_denied() -> None:
    """In the air only a forced disarming stops the motors."""
    pilot = flying()
    assert pilot.disarm(FLYING) == (False, "Disarming denied: not landed")
    assert pilot.armed
    assert pilot.disarm(FLYING, forced=True)[0]
    assert not pilot.armed


def test_an_idle_vehicle_disarms_itself() -> None:
    """On the ground without take-off it disarms after spool-up and COM_DISARM_PRFLT."""
    pilot = commander()
    pilot.arm(READY)
    pilot.update(replace(READY, now_s=5.0 + 10.9), False)
    assert pilot.armed
    pilot.update(replace(READY, now_s=5.0 + 11.1), False)
    assert not pilot.armed
    assert texts(pilot)[-1] == (6, "Disarmed by auto preflight disarming")


def test_after_landing_it_disarms_and_returns_to_the_mode_before() -> None:
    """Two seconds after landing the motors stop; the mode goes back to the last one that can start a flight."""
    pilot = flying(FlightMode.OFFBOARD)
    assert pilot.set_mode(FlightMode.LAND, FLYING)[0]
    landed = replace(FLYING, now_s=30.0, landed=True)
    pilot.update(landed, False)
    pilot.update(replace(landed, now_s=31.9), False)
    assert pilot.armed
    pilot.update(replace(landed, now_s=32.1), False)
    assert not pilot.armed
    assert mode_of(pilot) is FlightMode.OFFBOARD
    assert texts(pilot) == [(6, "Landing detected"), (6, "Disarmed by landing")]


def test_a_mode_that_is_none_is_refused() -> None:
    """OTHER cannot be asked for."""
    assert commander().set_mode(FlightMode.OTHER, READY) == (False, "Unsupported main mode")


def test_offboard_can_be_made_to_refuse() -> None:
    """The fault refuses offboard with a fresh stream, and on the ground."""
    pilot = commander()
    pilot.refuse_offboard = True
    assert not pilot.set_mode(FlightMode.OFFBOARD, replace(READY, setpoint_age_s=STREAM))[0]
