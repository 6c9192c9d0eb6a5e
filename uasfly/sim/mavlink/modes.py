"""Flight modes as PX4 writes them into HEARTBEAT, CURRENT_MODE and DO_SET_MODE.

Numbers from PX4's px4_custom_mode.h (main mode in bits 16-23, sub mode in bits 24-31); which base_mode belongs to
which mode was read from a recording of PX4.
"""

from __future__ import annotations

from uasfly.messages import FlightMode

MAIN_MANUAL, MAIN_POSITION, MAIN_AUTO, MAIN_OFFBOARD = 1, 3, 4, 6

_MAIN_AND_SUB: dict[FlightMode, tuple[int, int]] = {
    FlightMode.HOLD: (MAIN_AUTO, 3),
    FlightMode.TAKEOFF: (MAIN_AUTO, 2),
    FlightMode.LAND: (MAIN_AUTO, 6),
    FlightMode.RETURN: (MAIN_AUTO, 5),
    FlightMode.DESCEND: (MAIN_AUTO, 20),
    FlightMode.OFFBOARD: (MAIN_OFFBOARD, 0),
    FlightMode.POSITION: (MAIN_POSITION, 0),
    FlightMode.OTHER: (MAIN_MANUAL, 0),
}
# what a client may ask for: PX4 enters Descend by itself only
_ASKABLE = {
    numbers: mode for mode, numbers in _MAIN_AND_SUB.items() if mode not in (FlightMode.DESCEND, FlightMode.OTHER)
}
# MAV_STANDARD_MODE
_STANDARD = {FlightMode.POSITION: 1, FlightMode.RETURN: 5, FlightMode.LAND: 7, FlightMode.TAKEOFF: 8}

_CUSTOM, _AUTO, _GUIDED, _STABILIZE, _MANUAL, _ARMED = 1, 4, 8, 16, 64, 128


def custom_mode(mode: FlightMode) -> int:
    """PX4's 32-bit custom_mode of a flight mode."""
    main, sub = _MAIN_AND_SUB[mode]
    return main << 16 | sub << 24


def standard_mode(mode: FlightMode) -> int:
    """MAV_STANDARD_MODE of a flight mode, 0 where there is none."""
    return _STANDARD.get(mode, 0)


def asked_mode(main: int, sub: int) -> FlightMode | None:
    """Flight mode that a client asks for by PX4's main and sub mode; None where this vehicle has no such mode."""
    return _ASKABLE.get((main, sub if main == MAIN_AUTO else 0))


def base_mode(mode: FlightMode, armed: bool, setpoints_arrive: bool) -> int:
    """MAV_MODE_FLAG bits of HEARTBEAT; offboard controls the attitude only while setpoints arrive."""
    flags = _CUSTOM | (_ARMED if armed else 0)
    main = _MAIN_AND_SUB[mode][0]
    if main == MAIN_AUTO:
        flags |= _AUTO | _GUIDED | _STABILIZE
    elif main == MAIN_OFFBOARD:
        flags |= _STABILIZE if setpoints_arrive else 0
    else:
        flags |= _MANUAL | _STABILIZE
    return flags
