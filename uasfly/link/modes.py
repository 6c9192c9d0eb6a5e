"""PX4's flight modes and commands on the wire (px4_custom_mode.h; MAVLink common.xml)."""

from __future__ import annotations

from uasfly.messages import FlightMode, RequestKind

# MAV_CMD
CMD_DO_SET_MODE = 176
CMD_COMPONENT_ARM_DISARM = 400
CMD_SET_MESSAGE_INTERVAL = 511
CMD_REQUEST_MESSAGE = 512

MODE_FLAG_CUSTOM = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
MODE_FLAG_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED

MAIN_POSITION = 3
MAIN_AUTO = 4
MAIN_OFFBOARD = 6

_MODE_OF_AUTO_SUBMODE = {
    2: FlightMode.TAKEOFF,
    3: FlightMode.HOLD,
    5: FlightMode.RETURN,
    6: FlightMode.LAND,
    9: FlightMode.LAND,  # precision landing
    20: FlightMode.DESCEND,
}

_COMMAND_OF_KIND = {
    RequestKind.ARM: (CMD_COMPONENT_ARM_DISARM, (1.0,)),
    RequestKind.DISARM: (CMD_COMPONENT_ARM_DISARM, (0.0,)),
    RequestKind.TAKEOFF: (CMD_DO_SET_MODE, (MODE_FLAG_CUSTOM, 4.0, 2.0)),
    RequestKind.OFFBOARD: (CMD_DO_SET_MODE, (MODE_FLAG_CUSTOM, 6.0)),
    RequestKind.HOLD: (CMD_DO_SET_MODE, (MODE_FLAG_CUSTOM, 4.0, 3.0)),
    RequestKind.LAND: (CMD_DO_SET_MODE, (MODE_FLAG_CUSTOM, 4.0, 6.0)),
    RequestKind.RETURN: (CMD_DO_SET_MODE, (MODE_FLAG_CUSTOM, 4.0, 5.0)),
}


def flight_mode(custom_mode: int) -> FlightMode:
    """Flight mode of PX4's custom_mode: main mode in bits 16..23, sub mode in bits 24..31."""
    main, sub = (custom_mode >> 16) & 0xFF, (custom_mode >> 24) & 0xFF
    if main == MAIN_OFFBOARD:
        return FlightMode.OFFBOARD
    if main == MAIN_POSITION:
        return FlightMode.POSITION
    if main == MAIN_AUTO:
        return _MODE_OF_AUTO_SUBMODE.get(sub, FlightMode.OTHER)
    return FlightMode.OTHER


def command_of(kind: RequestKind) -> tuple[int, tuple[float, ...]]:
    """MAV_CMD number and its leading parameters that ask PX4 for `kind`; arming is never forced."""
    return _COMMAND_OF_KIND[kind]
