"""PX4's parameters: every value that PX4 gives a meaning, and parameters that are not told."""

from __future__ import annotations

import math

import pytest

from tests.data import test_data
from tests.flight.preflight.gathering import (
    AIRFRAME,
    OK,
    STOP,
    WARNING,
    check,
    facts,
    gathered,
    mission,
    parameter,
    verdict,
    view,
)
from uasfly.flight.choices import Engage
from uasfly.flight.preflight import PARAMETERS, judge
from uasfly.link.parameters import parameter_value
from uasfly.preflight_messages import Verdict
from uasfly.sim.parameters import ParameterTable

HOVER = AIRFRAME.model.hover_thrust


@pytest.mark.parametrize(
    ("name", "value", "expected", "told"),
    [
        ("COM_OF_LOSS_T", 1.0, OK, "1 s"),
        ("COM_OF_LOSS_T", 0.3, OK, "0.3 s"),
        ("COM_OF_LOSS_T", 0.1, WARNING, "hiccup"),
        ("COM_OF_LOSS_T", 2.5, WARNING, "2.5 s"),
        ("COM_OF_LOSS_T", 10.0, STOP, "10 s"),
        ("COM_OBL_RC_ACT", 0.0, WARNING, "0 (position): without a remote control it becomes a return"),
        ("COM_OBL_RC_ACT", 1.0, WARNING, "altitude"),
        ("COM_OBL_RC_ACT", 2.0, WARNING, "stabilized"),
        ("COM_OBL_RC_ACT", 3.0, WARNING, "3 (return)"),
        ("COM_OBL_RC_ACT", 4.0, OK, "4 (land)"),
        ("COM_OBL_RC_ACT", 5.0, OK, "5 (hold)"),
        ("COM_OBL_RC_ACT", 6.0, STOP, "6 (terminate): the vehicle falls"),
        ("COM_OBL_RC_ACT", 7.0, STOP, "7 (disarm): the vehicle falls"),
        ("COM_OBL_RC_ACT", -1.0, WARNING, "unknown"),
        ("COM_OBL_RC_ACT", 8.0, WARNING, "unknown"),
        ("COM_RC_IN_MODE", 0.0, OK, "0 (remote control)"),
        ("COM_RC_IN_MODE", 1.0, WARNING, "1 (MAVLink joystick only)"),
        ("COM_RC_IN_MODE", 3.0, OK, "the first heard"),
        ("COM_RC_IN_MODE", 4.0, WARNING, "no sticks at all"),
        ("COM_RC_IN_MODE", 6.0, OK, "by priority"),
        ("NAV_RCL_ACT", 1.0, OK, "1 (hold)"),
        ("NAV_RCL_ACT", 2.0, WARNING, "2 (return)"),
        ("NAV_RCL_ACT", 3.0, OK, "3 (land)"),
        ("NAV_RCL_ACT", 5.0, WARNING, "5 (terminate): the vehicle falls"),
        ("NAV_RCL_ACT", 6.0, WARNING, "6 (disarm): the vehicle falls"),
        ("NAV_RCL_ACT", 9.0, WARNING, "unknown"),
        ("NAV_DLL_ACT", 0.0, OK, "0 (nothing)"),
        ("NAV_DLL_ACT", 1.0, OK, "1 (hold)"),
        ("NAV_DLL_ACT", 2.0, WARNING, "2 (return)"),
        ("NAV_DLL_ACT", 3.0, OK, "3 (land)"),
        ("NAV_DLL_ACT", 5.0, WARNING, "the vehicle falls"),
        ("COM_LOW_BAT_ACT", 0.0, OK, "0 (warning at 7 %); the mission ends at 20 %"),
        ("COM_LOW_BAT_ACT", 1.0, WARNING, "1 (return at 7 %)"),
        ("COM_LOW_BAT_ACT", 2.0, OK, "2 (land at 7 %)"),
        ("COM_LOW_BAT_ACT", 3.0, WARNING, "3 (return, then land at 7 %)"),
        ("COM_LOW_BAT_ACT", 4.0, WARNING, "unknown"),
        ("MPC_THR_HOVER", HOVER * 1.05, OK, "+5 %"),
        ("MPC_THR_HOVER", HOVER * 1.2, WARNING, "+20 %"),
        ("MPC_THR_HOVER", HOVER * 0.8, WARNING, "-20 %"),
        ("MPC_THR_HOVER", HOVER * 1.4, STOP, "+40 %"),
        ("MPC_THR_HOVER", HOVER * 0.6, STOP, "-40 %"),
        ("COM_DISARM_PRFLT", 10.0, OK, "10 s"),
        ("COM_DISARM_PRFLT", 2.0, WARNING, "2 s"),
        ("COM_DISARM_PRFLT", -1.0, OK, "never"),
    ],
)
def test_each_value_has_its_verdict(name: str, value: float, expected: Verdict, told: str) -> None:
    """The line tells the value and PX4's word for it."""
    line = parameter(name, value)
    assert line.verdict is expected
    assert told in line.value


def test_offboard_may_be_exempt_from_lost_links() -> None:
    """Bit 2 of the exceptions, whatever other bits are set; other bits alone change nothing."""
    assert parameter("NAV_RCL_ACT", 2.0, COM_RCL_EXCEPT=4.0).verdict is OK
    assert parameter("NAV_RCL_ACT", 6.0, COM_RCL_EXCEPT=7.0).verdict is OK
    assert parameter("NAV_RCL_ACT", 2.0, COM_RCL_EXCEPT=3.0).verdict is WARNING
    assert parameter("NAV_RCL_ACT", 2.0, COM_RC_IN_MODE=4.0).verdict is OK
    assert parameter("NAV_DLL_ACT", 2.0, COM_DLL_EXCEPT=4.0).verdict is OK
    assert parameter("NAV_DLL_ACT", 2.0, COM_DLL_EXCEPT=math.nan).verdict is WARNING


def test_the_exception_is_needed_only_without_a_remote_control() -> None:
    """With one its loss should count; without sticks PX4 loses none."""
    assert parameter("COM_RCL_EXCEPT", 0.0).verdict is OK
    assert parameter("COM_RCL_EXCEPT", 0.0, COM_RC_IN_MODE=4.0).verdict is OK
    assert parameter("COM_RCL_EXCEPT", 0.0, COM_RC_IN_MODE=1.0).verdict is WARNING
    assert parameter("COM_RCL_EXCEPT", 3.0, COM_RC_IN_MODE=1.0).verdict is WARNING
    assert parameter("COM_RCL_EXCEPT", 4.0, COM_RC_IN_MODE=1.0).verdict is OK
    assert parameter("COM_RCL_EXCEPT", 0.0, COM_RC_IN_MODE=math.nan).verdict is WARNING


def test_px4_must_not_act_on_the_battery_before_the_mission_does() -> None:
    """A threshold above the mission's own, or a mission that only warns while PX4 only warns too."""
    early = parameter("COM_LOW_BAT_ACT", 2.0, BAT_CRIT_THR=0.25)
    assert (early.verdict, "before the mission's own end" in early.value) == (WARNING, True)
    only_warns = mission(monitors={"battery": {"action": "warn"}})
    told = facts({"COM_LOW_BAT_ACT": 0.0})
    assert verdict("COM_LOW_BAT_ACT", mission=only_warns, facts=told) is WARNING
    assert verdict("COM_LOW_BAT_ACT", facts=facts({"BAT_CRIT_THR": math.nan})) is OK


def test_the_disarming_time_counts_where_uasfly_takes_off() -> None:
    """Neither with a pilot nor in the air."""
    names = {line.name for line in judge(gathered(engage=Engage.PILOT))}
    assert "COM_DISARM_PRFLT" not in names
    assert "COM_DISARM_PRFLT" not in {line.name for line in judge(gathered(view=view(in_air=True)))}


def test_the_height_of_a_return_counts_where_the_mission_may_return() -> None:
    """At its end, or where a monitor asks for it."""
    assert "RTL_RETURN_ALT" not in {line.name for line in judge(gathered())}
    returning = mission(ending={"action": "return"})
    assert verdict("RTL_RETURN_ALT", mission=returning) is WARNING
    assert verdict("RTL_RETURN_ALT", mission=returning, facts=facts({"RTL_RETURN_ALT": 4.0})) is OK
    watched = mission(monitors={"tracking": {"then": "return"}})
    assert verdict("RTL_RETURN_ALT", mission=watched) is WARNING


@pytest.mark.parametrize("name", [name for name in PARAMETERS if name not in ("COM_DLL_EXCEPT", "BAT_CRIT_THR")])
def test_what_is_not_told_is_a_warning_that_says_so(name: str) -> None:
    """Never ok: not answered, and nothing asked at all."""
    returning = mission(ending={"action": "return"})
    line = check(name, mission=returning, facts=facts({name: math.nan}))
    assert (line.verdict, line.value) == (WARNING, "not told")
    assert verdict(name, mission=returning, facts=None) is WARNING


def test_the_simulated_vehicle_has_every_parameter() -> None:
    """Names of the list are PX4's, and types those of the recording."""
    table = ParameterTable()
    assert set(PARAMETERS) <= set(table)


def test_what_px4_answered_in_the_recording_is_judged_as_it_should_be() -> None:
    """From the bytes of its PARAM_VALUE to the lines: its simulator has no remote control and returns when it can."""
    mavutil = pytest.importorskip("pymavlink.mavutil")
    path = str(test_data("px4_recordings/conformance.tlog"))
    log = mavutil.mavlink_connection(path, dialect="development")
    recorded: dict[str, float] = {}
    while (message := log.recv_match(type="PARAM_VALUE")) is not None:
        value = parameter_value(message.to_dict())
        if value is not None:
            recorded[message.param_id] = value
    told = facts(parameters=dict.fromkeys(PARAMETERS, math.nan) | recorded)
    lines = {line.name: line for line in judge(gathered(facts=told)) if line.name in recorded}
    assert {name: line.verdict for name, line in lines.items()} == {
        "COM_OF_LOSS_T": OK,
        "COM_OBL_RC_ACT": OK,
        "COM_RC_IN_MODE": WARNING,
        "COM_RCL_EXCEPT": WARNING,
        "NAV_RCL_ACT": WARNING,
        "NAV_DLL_ACT": OK,
        "COM_LOW_BAT_ACT": WARNING,
        "MPC_THR_HOVER": STOP,  # the quadrotor of the recording hovers at 0.49, the airframe file's at 0.34
    }
    assert lines["MPC_THR_HOVER"].value.startswith("0.500, the airframe file hovers at 0.344")
