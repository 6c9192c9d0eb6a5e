"""PX4's parameters against the mission: what PX4 does by itself when something is lost.

Values and meanings are those of PX4's commander and failsafe (main of August 2026).
"""

from __future__ import annotations

from collections.abc import Iterator

from uasfly.flight.choices import Engage
from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.flight.preflight.place import may_return
from uasfly.preflight_messages import PreflightCheck

PARAMETERS = (
    "COM_OF_LOSS_T",
    "COM_OBL_RC_ACT",
    "COM_RC_IN_MODE",
    "COM_RCL_EXCEPT",
    "COM_DLL_EXCEPT",
    "COM_DISARM_PRFLT",
    "COM_LOW_BAT_ACT",
    "BAT_CRIT_THR",
    "MPC_THR_HOVER",
    "NAV_RCL_ACT",
    "NAV_DLL_ACT",
    "RTL_RETURN_ALT",
)

LOSS_SHORTEST_S = 0.3  # setpoints may pause for 0.2 s before uasfly itself calls it a silence
LOSS_LONG_S, LOSS_LONGEST_S = 2.0, 5.0  # a tilt of 5 deg makes 2 m/s of it in the former, 4 m/s in the latter
HOVER_WARNING, HOVER_STOP = 0.1, 0.3  # 1 and 3 m/s^2 up or down in the first moment of offboard
TAKEOFF_TAKES_S = 5.0  # 1 s of spooling up (COM_SPOOLUP_TIME), 3 s of ramp (MPC_TKO_RAMP_T), and the request
OFFBOARD = 4  # bit of COM_RCL_EXCEPT and COM_DLL_EXCEPT

_LOSS_ACTIONS = ("position", "altitude", "stabilized", "return", "land", "hold", "terminate", "disarm")
_LINK_ACTIONS = {0: "nothing", 1: "hold", 2: "return", 3: "land", 5: "terminate", 6: "disarm"}
_BATTERY_ACTIONS = {0: "warning", 1: "return", 2: "land", 3: "return, then land"}
_STICKS = {
    0: "remote control",
    1: "MAVLink joystick only",
    2: "remote control or joystick",
    3: "remote control or joystick, the first heard",
    4: "no sticks at all",
}
_RETURN, _MOTORS_OFF = "return", ("terminate", "disarm")
_CLIMB = "a return climbs to RTL_RETURN_ALT first, through whatever is above"

_LOSS_TIME = Subject("COM_OF_LOSS_T", "when setpoints stop, the vehicle keeps its last tilt for so long")
_LOSS_ACTION = Subject("COM_OBL_RC_ACT", f"what PX4 does when setpoints stop; {_CLIMB}")
_INPUT = Subject("COM_RC_IN_MODE", "the pilot takes over with the remote control's mode switch")
_EXCEPTIONS = Subject(
    "COM_RCL_EXCEPT", "without a remote control PX4 may act on its loss (NAV_RCL_ACT) in offboard too"
)
_REMOTE_LOSS = Subject("NAV_RCL_ACT", f"what PX4 does when the remote control is lost in offboard; {_CLIMB}")
_GROUND_LOSS = Subject("NAV_DLL_ACT", f"what PX4 does when the ground station is lost in offboard; {_CLIMB}")
_LOW_BATTERY = Subject("COM_LOW_BAT_ACT", f"what PX4 does below BAT_CRIT_THR; {_CLIMB}")
_HOVER = Subject(
    "MPC_THR_HOVER", "take-off and every mode of PX4 start from it; far off, the airframe file is another's"
)
_DISARM = Subject("COM_DISARM_PRFLT", "PX4 disarms a vehicle that has not taken off within this time")
_RETURN_HEIGHT = Subject("RTL_RETURN_ALT", "the mission may return: PX4 climbs to this height before it flies home")


def parameter_checks(gathered: Gathered) -> Iterator[PreflightCheck]:
    """All checks of this file."""
    yield _loss_time(gathered)
    yield _loss_action(gathered)
    yield _input(gathered)
    yield _exceptions(gathered)
    yield _remote_loss(gathered)
    yield _ground_loss(gathered)
    yield _low_battery(gathered)
    yield _hover(gathered)
    if gathered.engage is Engage.AUTO and not gathered.view.in_air:
        yield _disarm(gathered)
    if may_return(gathered):
        yield _return_height(gathered)


def _unknown(subject: Subject) -> PreflightCheck:
    return subject.warning("not told", "PX4 did not answer: look at it in a ground station")


def _whole(gathered: Gathered, name: str) -> int | None:
    value = gathered.parameter(name)
    return None if value is None else round(value)


def _loss_time(gathered: Gathered) -> PreflightCheck:
    seconds = gathered.parameter("COM_OF_LOSS_T")
    if seconds is None:
        return _unknown(_LOSS_TIME)
    value, remedy = f"{seconds:g} s", "set it to 1 s"
    if seconds > LOSS_LONGEST_S:
        return _LOSS_TIME.stop(value, remedy)
    if seconds > LOSS_LONG_S:
        return _LOSS_TIME.warning(value, remedy)
    if seconds < LOSS_SHORTEST_S:
        return _LOSS_TIME.warning(f"{value}: a hiccup of this computer is a failsafe", remedy)
    return _LOSS_TIME.ok(value)


def _loss_action(gathered: Gathered) -> PreflightCheck:
    action = _whole(gathered, "COM_OBL_RC_ACT")
    if action is None:
        return _unknown(_LOSS_ACTION)
    name = _LOSS_ACTIONS[action] if 0 <= action < len(_LOSS_ACTIONS) else "unknown"
    value, remedy = f"{action} ({name})", "set it to 5 (hold) or 4 (land)"
    if name in ("hold", "land"):
        return _LOSS_ACTION.ok(value)
    if name in _MOTORS_OFF:  # this very program may crash
        return _LOSS_ACTION.stop(f"{value}: the vehicle falls", remedy)
    if name in ("position", "altitude", "stabilized"):
        return _LOSS_ACTION.warning(f"{value}: without a remote control it becomes a return", remedy)
    return _LOSS_ACTION.warning(value, remedy)


def _input(gathered: Gathered) -> PreflightCheck:
    mode = _whole(gathered, "COM_RC_IN_MODE")
    if mode is None:
        return _unknown(_INPUT)
    value = f"{mode} ({_STICKS.get(mode, 'several, by priority')})"
    if mode in (1, 4):
        return _INPUT.warning(
            value, "fly with a remote control: 0 or 3; else have a ground station at hand to take over"
        )
    return _INPUT.ok(value)


def _exceptions(gathered: Gathered) -> PreflightCheck:
    """Needed only where no remote control is flown; the loss of one that is there should count."""
    mask, mode = _whole(gathered, "COM_RCL_EXCEPT"), _whole(gathered, "COM_RC_IN_MODE")
    if mask is None:
        return _unknown(_EXCEPTIONS)
    if mask & OFFBOARD:
        return _EXCEPTIONS.ok(f"{mask} (offboard is exempt)")
    value = f"{mask} (offboard is not exempt)"
    if mode == 1:
        remedy = "flown without a joystick, add 4 (offboard); recent PX4 ignores a loss from before arming"
        return _EXCEPTIONS.warning(value, remedy)
    if mode is None:
        return _EXCEPTIONS.warning(value, "flown without a remote control, add 4 (offboard)")
    return _EXCEPTIONS.ok(value)


def _remote_loss(gathered: Gathered) -> PreflightCheck:
    exempt = _exempt(gathered, "COM_RCL_EXCEPT") or _whole(gathered, "COM_RC_IN_MODE") == 4
    remedy = "set it to 1 (hold) or 3 (land)"
    return _link_loss(_REMOTE_LOSS, _whole(gathered, "NAV_RCL_ACT"), exempt, remedy)


def _ground_loss(gathered: Gathered) -> PreflightCheck:
    exempt = _exempt(gathered, "COM_DLL_EXCEPT")
    return _link_loss(
        _GROUND_LOSS, _whole(gathered, "NAV_DLL_ACT"), exempt, "set it to 0 (nothing), 1 (hold) or 3 (land)"
    )


def _exempt(gathered: Gathered, name: str) -> bool:
    return bool((_whole(gathered, name) or 0) & OFFBOARD)


def _link_loss(subject: Subject, action: int | None, exempt: bool, remedy: str) -> PreflightCheck:
    if action is None:
        return _unknown(subject)
    name = _LINK_ACTIONS.get(action, "unknown")
    value = f"{action} ({name})"
    if exempt:
        return subject.ok(f"{value}, offboard is exempt")
    if name in _MOTORS_OFF:  # some rules ask for it, so it is not for uasfly to forbid
        return subject.warning(f"{value}: the vehicle falls", remedy)
    return subject.warning(value, remedy) if name in (_RETURN, "unknown") else subject.ok(value)


def _low_battery(gathered: Gathered) -> PreflightCheck:
    action, critical = _whole(gathered, "COM_LOW_BAT_ACT"), gathered.parameter("BAT_CRIT_THR")
    settings = gathered.mission.monitors.battery
    if action is None:
        return _unknown(_LOW_BATTERY)
    name = _BATTERY_ACTIONS.get(action, "unknown")
    at = "" if critical is None else f" at {critical * 100.0:.0f} %"
    value = f"{action} ({name}{at})"
    if action == 0:
        if settings.action == "warn":
            return _LOW_BATTERY.warning(f"{value}: nothing ends the flight", "let monitors.battery.action be end")
        return _LOW_BATTERY.ok(f"{value}; the mission ends at {settings.remaining * 100.0:.0f} %")
    if critical is not None and critical >= settings.remaining:
        remedy = f"lower BAT_CRIT_THR below monitors.battery.remaining, {settings.remaining:g}"
        return _LOW_BATTERY.warning(f"{value}: before the mission's own end", remedy)
    return _LOW_BATTERY.ok(value) if action == 2 else _LOW_BATTERY.warning(value, "set it to 2 (land) near a structure")


def _hover(gathered: Gathered) -> PreflightCheck:
    told, expected = gathered.parameter("MPC_THR_HOVER"), gathered.airframe.model.hover_thrust
    if told is None:
        return _unknown(_HOVER)
    off = told / expected - 1.0
    value = f"{told:.3f}, the airframe file hovers at {expected:.3f} ({off * 100.0:+.0f} %)"
    remedy = f"fly the airframe file of this vehicle; where it is, set MPC_THR_HOVER to {expected:.2f}"
    if abs(off) > HOVER_STOP:
        return _HOVER.stop(value, remedy)
    return _HOVER.warning(value, remedy) if abs(off) > HOVER_WARNING else _HOVER.ok(value)


def _disarm(gathered: Gathered) -> PreflightCheck:
    seconds = gathered.parameter("COM_DISARM_PRFLT")
    if seconds is None:
        return _unknown(_DISARM)
    if 0.0 < seconds < TAKEOFF_TAKES_S:
        return _DISARM.warning(
            f"{seconds:g} s", f"set it to {2.0 * TAKEOFF_TAKES_S:g} s: the take-off takes some seconds"
        )
    return _DISARM.ok(f"{seconds:g} s" if seconds > 0.0 else "never")


def _return_height(gathered: Gathered) -> PreflightCheck:
    height, highest = gathered.parameter("RTL_RETURN_ALT"), gathered.mission.limits.altitude_max_m
    if height is None:
        return _unknown(_RETURN_HEIGHT)
    value = f"{height:g} m, the mission's limit is {highest:g} m"
    if height > highest:
        return _RETURN_HEIGHT.warning(value, "lower it, or let the mission end with land or hold")
    return _RETURN_HEIGHT.ok(value)
