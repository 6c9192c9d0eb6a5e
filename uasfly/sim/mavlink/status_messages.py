"""Telemetry of the vehicle's state and health, field by field as PX4 fills it (main of August 2026)."""

from __future__ import annotations

import math
from collections.abc import Callable

from pymavlink.dialects.v20 import development as dialect

from uasfly.messages import FlightMode, TextSample
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.modes import base_mode, custom_mode, standard_mode
from uasfly.sim.mavlink.motion_messages import microseconds, milliseconds
from uasfly.sim.mavlink.vehicle_view import VehicleView

MAVLINK_VERSION = 3
# SYS_STATUS of PX4 on the ground with everything healthy, as recorded
SENSORS_PRESENT = 0x0300C02F
SENSORS_ENABLED = 0x0301C02F
SENSORS_HEALTHY = 0x0320C83F
SENSOR_GPS = dialect.MAV_SYS_STATUS_SENSOR_GPS
SENSOR_POSITION = dialect.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
PREARM_CHECK = dialect.MAV_SYS_STATUS_PREARM_CHECK
PROCESSOR_LOAD_PERMILLE = 120
# ESTIMATOR_STATUS: bits that fall with the horizontal velocity, with the position, and that only stand on the ground
_VELOCITY_HORIZONTAL = 2
_POSITION_HORIZONTAL = 8 | 16
_PREDICTED_POSITION = 256 | 512
_ALWAYS = 1 | 4 | 32 | 64
_AT_REST = 128
TEST_RATIO = 0.01  # innovation over gate: small when all is well
VERTICAL_ACCURACY_M = 0.034
# charge states of BATTERY_STATUS below the thresholds of these parameters (and PX4's defaults)
LOW_CHARGE = (("BAT_EMERGEN_THR", 0.05, 4), ("BAT_CRIT_THR", 0.07, 3), ("BAT_LOW_THR", 0.15, 2))
_UNKNOWN_U16 = 0xFFFF
TEXT_LENGTH = 50


def heartbeat(view: VehicleView) -> Message:
    """HEARTBEAT."""
    state = view.state
    if state.armed:
        status = dialect.MAV_STATE_CRITICAL if view.failsafe else dialect.MAV_STATE_ACTIVE
    else:
        status = dialect.MAV_STATE_STANDBY if view.can_arm else dialect.MAV_STATE_UNINIT
    return dialect.MAVLink_heartbeat_message(
        min(0xFF, max(0, round(view.parameter("MAV_TYPE", dialect.MAV_TYPE_QUADROTOR)))),
        dialect.MAV_AUTOPILOT_PX4,
        base_mode(state.mode, state.armed, view.setpoints_arrive),
        custom_mode(state.mode),
        status,
        MAVLINK_VERSION,
    )


def current_mode(view: VehicleView) -> Message:
    """CURRENT_MODE."""
    mode = view.state.mode
    return dialect.MAVLink_current_mode_message(standard_mode(mode), custom_mode(mode), custom_mode(view.intended_mode))


def system_status(view: VehicleView) -> Message:
    """SYS_STATUS. As recorded, GNSS leaves "present" and "enabled" when it is given up, a lost position "health"."""
    gps = 0 if view.gnss_present else SENSOR_GPS
    healthy = SENSORS_HEALTHY & ~(0 if view.position_trusted else SENSOR_POSITION)
    healthy |= PREARM_CHECK if view.can_arm or view.state.armed else 0
    battery = view.vehicle.battery()
    return dialect.MAVLink_sys_status_message(
        SENSORS_PRESENT & ~gps,
        SENSORS_ENABLED & ~gps,
        healthy,
        PROCESSOR_LOAD_PERMILLE,
        millivolts(battery.voltage_v),
        -1,
        percent(math.ceil, battery.remaining),
        *(0,) * 6,
        0,
        0,
        1,
    )


def extended_system_state(view: VehicleView) -> Message:
    """EXTENDED_SYS_STATE: on the ground, taking off, landing or in the air."""
    state = view.state
    if not state.in_air:
        landed = dialect.MAV_LANDED_STATE_ON_GROUND
    elif state.mode is FlightMode.TAKEOFF:
        landed = dialect.MAV_LANDED_STATE_TAKEOFF
    elif state.mode is FlightMode.LAND:
        landed = dialect.MAV_LANDED_STATE_LANDING
    else:
        landed = dialect.MAV_LANDED_STATE_IN_AIR
    return dialect.MAVLink_extended_sys_state_message(dialect.MAV_VTOL_STATE_UNDEFINED, landed)


def estimator_status(view: VehicleView) -> Message:
    """ESTIMATOR_STATUS. Height above ground counts as known, as in the recording: the simulation's ground is level."""
    health = view.health
    flags = _ALWAYS if health.attitude_ok else 0
    flags |= _VELOCITY_HORIZONTAL if health.velocity_ok else 0
    flags |= _POSITION_HORIZONTAL if health.position_ok else 0
    flags |= _PREDICTED_POSITION if health.attitude_ok and view.gnss_used else 0
    flags |= 0 if view.state.in_air else _AT_REST
    fused = TEST_RATIO if health.gnss_fix >= 3 else math.nan
    return dialect.MAVLink_estimator_status_message(
        microseconds(view.time_s),
        flags,
        fused,
        fused,
        TEST_RATIO,
        TEST_RATIO,
        TEST_RATIO,
        math.nan,
        health.horizontal_accuracy_m,
        VERTICAL_ACCURACY_M,
    )


def battery_status(view: VehicleView) -> Message:
    """BATTERY_STATUS: PX4's simulated battery tells the whole voltage in the first cell, and no current."""
    battery = view.vehicle.battery()
    charge = next((state for name, value, state in LOW_CHARGE if battery.remaining < view.parameter(name, value)), 1)
    return dialect.MAVLink_battery_status_message(
        0,
        dialect.MAV_BATTERY_FUNCTION_ALL,
        dialect.MAV_BATTERY_TYPE_LIPO,
        0x7FFF,
        [millivolts(battery.voltage_v), *(_UNKNOWN_U16,) * 9],
        -1,
        0,
        -1,
        percent(round, battery.remaining),
        0,
        charge,
        [0] * 4,
        0,
        0,
    )


def mission_current(view: VehicleView) -> Message:
    """MISSION_CURRENT: there is no mission (state 1); take-off and landing count as its active modes."""
    active = view.state.mode in (FlightMode.TAKEOFF, FlightMode.LAND, FlightMode.RETURN)
    return dialect.MAVLink_mission_current_message(0, _UNKNOWN_U16, 1, 1 if active else 2)


def vibration(view: VehicleView) -> Message:
    """VIBRATION: the plant does not shake."""
    return dialect.MAVLink_vibration_message(microseconds(view.time_s), 0.0, 0.0, 0.0, 0, 0, 0)


def system_time(view: VehicleView, unix_s: float) -> Message:
    """SYSTEM_TIME."""
    return dialect.MAVLink_system_time_message(int(unix_s * 1e6), milliseconds(view.time_s))


def status_texts(text: TextSample, identity: int) -> list[Message]:
    """STATUSTEXT, in as many pieces as it needs; `identity` (1..65535) holds the pieces together."""
    raw = text.text.encode()
    severity = min(7, max(0, text.severity))
    if len(raw) <= TEXT_LENGTH:
        return [dialect.MAVLink_statustext_message(severity, raw, 0, 0)]
    pieces = [raw[start : start + TEXT_LENGTH] for start in range(0, len(raw), TEXT_LENGTH)]
    if len(pieces[-1]) == TEXT_LENGTH:
        pieces.append(b"")  # a text ends with the first piece that is not full
    return [
        dialect.MAVLink_statustext_message(severity, piece, identity, number) for number, piece in enumerate(pieces)
    ]


def millivolts(voltage_v: float) -> int:
    """Voltage as the 16-bit millivolts of SYS_STATUS and BATTERY_STATUS; 65535 where unknown."""
    return min(_UNKNOWN_U16 - 1, max(0, int(voltage_v * 1e3))) if math.isfinite(voltage_v) else _UNKNOWN_U16


def percent(whole: Callable[[float], int], fraction: float) -> int:
    """Fraction 0..1 as whole per cent, rounded by `whole`; -1 where unknown."""
    return min(100, max(0, whole(100.0 * fraction))) if math.isfinite(fraction) else -1
