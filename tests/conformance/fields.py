"""What the fields of each message say while the vehicle stands idle: frames, constants, flags, unknowns, sizes."""

from __future__ import annotations

import math

from tests.conformance.recording import Message, Recording, contents
from tests.conformance.replay import SYSTEM, Flight
from tests.conformance.rows import Row, close, same
from tests.conformance.streams import IDLE

# Fields that must be the same in idle, and fields that must agree within a tolerance.
SAME: dict[str, tuple[str, ...]] = {
    "HEARTBEAT": ("type", "autopilot", "base_mode", "custom_mode", "system_status", "mavlink_version"),
    "ODOMETRY": ("frame_id", "child_frame_id", "estimator_type", "quality"),
    "ATTITUDE_TARGET": ("type_mask",),
    "SYS_STATUS": (
        "onboard_control_sensors_present",
        "onboard_control_sensors_enabled",
        "onboard_control_sensors_health",
        "current_battery",
        "battery_remaining",
        "onboard_control_sensors_health_extended",
    ),
    "EXTENDED_SYS_STATE": ("vtol_state", "landed_state"),
    "BATTERY_STATUS": (
        "id",
        "battery_function",
        "type",
        "temperature",
        "current_battery",
        "current_consumed",
        "energy_consumed",
        "battery_remaining",
        "time_remaining",
        "charge_state",
        "voltages_ext",
        "mode",
        "fault_bitmask",
    ),
    "ESTIMATOR_STATUS": ("flags",),
    "GPS_RAW_INT": ("fix_type", "eph", "epv", "satellites_visible", "h_acc", "v_acc", "vel_acc", "hdg_acc", "yaw"),
    "CURRENT_MODE": ("standard_mode", "custom_mode", "intended_custom_mode"),
    "MISSION_CURRENT": ("seq", "total", "mission_state", "mission_mode"),
    "POSITION_TARGET_LOCAL_NED": ("coordinate_frame", "type_mask", "afx", "afy", "afz", "yaw_rate"),
    "TIMESYNC": ("tc1",),
    "PING": ("target_system", "target_component"),
    "HIGHRES_IMU": ("temperature", "diff_pressure", "id"),
    "VFR_HUD": ("throttle",),
}
CLOSE: dict[str, dict[str, float]] = {
    "ATTITUDE": {"roll": 0.05, "pitch": 0.05, "rollspeed": 0.05, "pitchspeed": 0.05, "yawspeed": 0.05},
    "ATTITUDE_TARGET": {"thrust": 1e-4},
    "LOCAL_POSITION_NED": {"x": 1.0, "y": 1.0, "z": 1.0, "vx": 0.3, "vy": 0.3, "vz": 0.3},
    "GLOBAL_POSITION_INT": {"lat": 100.0, "lon": 100.0, "alt": 1000.0, "relative_alt": 500.0},
    "GPS_RAW_INT": {"lat": 100.0, "lon": 100.0, "alt": 3000.0, "alt_ellipsoid": 3000.0},
    "HOME_POSITION": {"latitude": 100.0, "longitude": 100.0, "altitude": 1000.0},
    "ALTITUDE": {"altitude_amsl": 1.0, "altitude_monotonic": 3.0, "altitude_relative": 0.5, "altitude_terrain": 0.5},
    "HIGHRES_IMU": {"xacc": 0.7, "yacc": 0.7, "zacc": 0.7, "abs_pressure": 0.3, "pressure_alt": 3.0},
    "SCALED_PRESSURE": {"press_abs": 0.3},
    "ESTIMATOR_STATUS": {"pos_horiz_accuracy": 0.3, "pos_vert_accuracy": 0.1},
    "SYS_STATUS": {"voltage_battery": 1500.0},
}

_UNITS = {
    "deg 1e-7": ("lat", "lon", "latitude", "longitude"),
    "mm": ("alt", "relative_alt", "alt_ellipsoid", "altitude"),
    "mV": ("voltage_battery",),
    "hPa": ("abs_pressure", "press_abs"),
    "m": ("x", "y", "z", "pressure_alt", "pos_horiz_accuracy", "pos_vert_accuracy"),
    "m/s": ("vx", "vy", "vz"),
    "m/s2": ("xacc", "yacc", "zacc"),
    "rad": ("roll", "pitch"),
    "rad/s": ("rollspeed", "pitchspeed", "yawspeed"),
}
_UNIT_OF = {field: unit for unit, fields in _UNITS.items() for field in fields}
_SIZE_REASON = "unit, sign and size: noise and place of the two differ"
_MOST_BELOW, _MOST_ABOVE = 100.0, 30.0  # times the recorded variance


def field_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Every comparison of fields."""
    theirs = [one for one in recording.during(IDLE) if one.message is not None]
    ours = flight.during(recording.phase(IDLE))
    names = sorted({one.message.get_type() for one in ours})
    theirs_by_name = {name: contents(theirs, name) for name in names}
    ours_by_name = {name: contents(ours, name) for name in names}
    rows = [same("identity", "system and component of every message", *map(_ids, (theirs_by_name, ours_by_name)))]
    rows.append(same("identity", "they are", str({(SYSTEM, 1)}), _ids(ours_by_name)))
    rows += _constants(theirs_by_name, ours_by_name)
    rows += _measurements(theirs_by_name, ours_by_name)
    rows += [_unknowns(name, theirs_by_name[name][-1], ours_by_name[name][-1]) for name in names]
    return rows + _covariances(theirs_by_name["ODOMETRY"][-1], ours_by_name["ODOMETRY"][-1])


def _ids(messages: dict[str, list[Message]]) -> str:
    return str({(m.get_srcSystem(), m.get_srcComponent()) for kind in messages.values() for m in kind})


def _constants(theirs: dict[str, list[Message]], ours: dict[str, list[Message]]) -> list[Row]:
    """Constants, flags and states: all values that came."""
    rows = []
    for name, fields in SAME.items():
        for field in fields:
            values = (", ".join(sorted({repr(getattr(m, field)) for m in side[name]})) for side in (theirs, ours))
            aspect = "ODOMETRY frames" if field.endswith("frame_id") else "constant field"
            rows.append(same(aspect, f"{name}.{field}", *values))
    return rows


def _measurements(theirs: dict[str, list[Message]], ours: dict[str, list[Message]]) -> list[Row]:
    """Of ours, the value that is farthest from the last recorded one."""
    rows = []
    for name, tolerances in CLOSE.items():
        for field, tolerance in tolerances.items():
            expected = float(getattr(theirs[name][-1], field))
            worst = max((float(getattr(m, field)) for m in ours[name]), key=lambda value: abs(value - expected))
            digits = 4 if tolerance < 0.01 else 2 if tolerance < 50.0 else 0
            unit = _UNIT_OF.get(field, "m" if name == "ALTITUDE" else "")
            rows.append(
                close("measured field", f"{name}.{field}", (expected, worst), tolerance, unit, _SIZE_REASON, digits)
            )
    return rows


def _unknowns(name: str, theirs: Message, ours: Message) -> Row:
    """Fields that are NaN, which means unknown."""
    return same("unknown fields", name, _nan_fields(theirs), _nan_fields(ours))


def _nan_fields(message: Message) -> str:
    values = ((field, getattr(message, field)) for field in message.get_fieldnames())
    return ", ".join(field for field, value in values if isinstance(value, float) and math.isnan(value)) or "no NaN"


def _covariances(theirs: Message, ours: Message) -> list[Row]:
    """Which elements of ODOMETRY's covariances are filled, and their size."""
    rows = []
    for field in ("pose_covariance", "velocity_covariance"):
        pairs = list(zip(getattr(theirs, field), getattr(ours, field), strict=True))
        filled = (" ".join(str(i) for i, pair in enumerate(pairs) if pair[side] != 0.0) for side in (0, 1))
        rows.append(same("covariance", f"ODOMETRY.{field}: filled", *filled))
        ratios = [mine / its for its, mine in pairs if its != 0.0]
        within = all(1.0 / _MOST_BELOW <= ratio <= _MOST_ABOVE for ratio in ratios)
        rows.append(
            Row(
                "covariance",
                f"ODOMETRY.{field}: times PX4's",
                "1",
                f"{min(ratios):.2g} to {max(ratios):.2g}",
                "",
                f"{1.0 / _MOST_BELOW:g} to {_MOST_ABOVE:g}",
                within,
                "size only: the variances come of other sensors",
            )
        )
    return rows
