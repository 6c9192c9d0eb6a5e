"""Telemetry of the vehicle's motion, field by field as PX4 fills it (main of August 2026)."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import development as dialect

from uasfly.frames import swap_quaternion_enu_ned
from uasfly.messages import FlightMode
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.vehicle_view import VehicleView, quadruple
from uasfly.sim.sensors import HOME_ALTITUDE_M, HOME_LATITUDE_DEG, HOME_LONGITUDE_DEG, geographic_position

LOCAL_NED = dialect.MAV_FRAME_LOCAL_NED
IDLE_ATTITUDE_THRUST = 0.001
TARGET_REPEATED_S = 0.5
# variances that PX4's estimator settles at in the recording: position m^2, attitude rad^2, velocity (m/s)^2
HEIGHT_VARIANCE_M2 = 1.2e-3
ATTITUDE_VARIANCE_RAD2 = 3e-4
YAW_VARIANCE_RAD2 = 4e-3
HORIZONTAL_VELOCITY_VARIANCE = 9e-3
VERTICAL_VELOCITY_VARIANCE = 1.3e-3
_IGNORE_POSITION_AND_VELOCITY = 63
_UNKNOWN_HEADING = 0xFFFF


def milliseconds(time_s: float) -> int:
    """Time since boot as MAVLink's 32-bit milliseconds; 0 for a clock that has been set back beyond its start."""
    return max(0, int(time_s * 1e3 + 1e-6)) & 0xFFFFFFFF


def microseconds(time_s: float) -> int:
    """Time since boot as MAVLink's microseconds; 0 for a clock that has been set back beyond its start."""
    return max(0, int(time_s * 1e6 + 0.5))


def int16(value: float) -> int:
    """Whole number that fits a signed 16-bit field."""
    return int(min(32767.0, max(-32768.0, value)))


def int32(value: float) -> int:
    """Whole number that fits a signed 32-bit field."""
    return int(min(2147483647.0, max(-2147483648.0, value)))


def centidegrees(heading_deg: float) -> int:
    """Heading of GLOBAL_POSITION_INT; 65535 where it is not known."""
    return int(heading_deg * 100.0) % 36000 if math.isfinite(heading_deg) else _UNKNOWN_HEADING


def attitude(view: VehicleView) -> Message:
    """ATTITUDE."""
    motion = view.motion
    return dialect.MAVLink_attitude_message(milliseconds(motion.time_s), *motion.euler_rad, *motion.rates_rad_s)


def attitude_quaternion(view: VehicleView) -> Message:
    """ATTITUDE_QUATERNION."""
    motion = view.motion
    return dialect.MAVLink_attitude_quaternion_message(
        milliseconds(motion.time_s), *motion.quaternion, *motion.rates_rad_s, [0.0] * 4
    )


class AttitudeTargets:
    """ATTITUDE_TARGET, whichever mode sets the target; a disarmed vehicle holds its heading with PX4's idle thrust.

    In offboard it is the last setpoint and the time when that came. Where none comes any more PX4 is silent, and says
    the old one again after half a second, for as long as it is armed.
    """

    def __init__(self) -> None:
        self._said_s = -math.inf

    def __call__(self, view: VehicleView) -> Message | None:
        """Build the message; None where nothing is new."""
        sample = view.vehicle.attitude_target()
        stamp_s = sample.time_s
        if view.state.mode is FlightMode.OFFBOARD:
            stamp_s = view.last_setpoint_s
            old = stamp_s == self._said_s
            if stamp_s == -math.inf or (old and not (view.state.armed and view.time_s - stamp_s > TARGET_REPEATED_S)):
                return None
        self._said_s = stamp_s
        thrust = sample.thrust if view.state.armed else IDLE_ATTITUDE_THRUST
        quaternion = quadruple(swap_quaternion_enu_ned(sample.quaternion_body_to_world))
        return dialect.MAVLink_attitude_target_message(milliseconds(stamp_s), 0, quaternion, 0.0, 0.0, 0.0, thrust)


def local_position(view: VehicleView) -> Message:
    """LOCAL_POSITION_NED."""
    motion = view.motion
    return dialect.MAVLink_local_position_ned_message(
        milliseconds(motion.time_s), *motion.position_m, *motion.velocity_m_s
    )


def odometry(view: VehicleView) -> Message:
    """ODOMETRY: PX4 gives the velocity in NED too and says so in child_frame_id."""
    motion = view.motion
    horizontal = 0.5 * view.health.horizontal_accuracy_m**2  # the accuracy is that of both axes together
    pose = [0.0] * 21
    pose[0] = pose[6] = horizontal
    pose[11] = HEIGHT_VARIANCE_M2
    pose[15] = pose[18] = ATTITUDE_VARIANCE_RAD2
    pose[20] = YAW_VARIANCE_RAD2
    velocity = [0.0] * 21
    velocity[0] = velocity[6] = HORIZONTAL_VELOCITY_VARIANCE
    velocity[11] = VERTICAL_VELOCITY_VARIANCE
    return dialect.MAVLink_odometry_message(
        microseconds(motion.time_s),
        LOCAL_NED,
        LOCAL_NED,
        *motion.position_m,
        motion.quaternion,
        *motion.velocity_m_s,
        *motion.rates_rad_s,
        pose,
        velocity,
        motion.reset_counter & 0xFF,
        dialect.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        0,
    )


def position_target_local(view: VehicleView) -> Message | None:
    """POSITION_TARGET_LOCAL_NED as PX4 sends it before take-off: no target, full acceleration downwards.

    In flight it is left out: the simulated vehicle does not tell the targets of its own modes.
    """
    if view.state.armed:
        return None
    motion, unknown = view.motion, (math.nan,) * 6
    return dialect.MAVLink_position_target_local_ned_message(
        milliseconds(motion.time_s),
        LOCAL_NED,
        _IGNORE_POSITION_AND_VELOCITY,
        *unknown,
        0.0,
        0.0,
        100.0,
        motion.euler_rad[2],
        0.0,
    )


def global_position(view: VehicleView) -> Message | None:
    """GLOBAL_POSITION_INT; None where the position is not known: its whole numbers cannot say so."""
    motion, home_down = view.motion, view.home.position_m[2]
    north, east, down = motion.position_m
    if not all(map(math.isfinite, (*motion.position_m, home_down, *motion.velocity_m_s))):
        return None
    latitude, longitude, above_sea = geographic_position((east, north, -down))
    v_north, v_east, v_down = motion.velocity_m_s
    return dialect.MAVLink_global_position_int_message(
        milliseconds(motion.time_s),
        int32(latitude * 1e7),
        int32(longitude * 1e7),
        int32(above_sea * 1e3),
        int32((home_down - down) * 1e3),
        int16(v_north * 100.0),
        int16(v_east * 100.0),
        int16(v_down * 100.0),
        centidegrees(motion.heading_deg),
    )


def altitude(view: VehicleView) -> Message:
    """ALTITUDE; the ground of the simulation is level, so the terrain is at home's height."""
    down = view.motion.position_m[2]
    home_down = view.home.position_m[2]
    above_sea = HOME_ALTITUDE_M - down
    return dialect.MAVLink_altitude_message(
        microseconds(view.time_s), above_sea, above_sea, -down, home_down - down, -home_down, home_down - down
    )


def vfr_hud(view: VehicleView) -> Message | None:
    """VFR_HUD; no airspeed sensor, so NaN; None where the heading is not known: its whole number cannot say so."""
    motion = view.motion
    if not math.isfinite(motion.heading_deg):
        return None
    v_north, v_east, v_down = motion.velocity_m_s
    throttle = int(100.0 * view.vehicle.attitude_target().thrust) if view.state.armed else 0
    return dialect.MAVLink_vfr_hud_message(
        math.nan,
        math.hypot(v_north, v_east),
        int(motion.heading_deg),
        min(100, max(0, throttle)),
        HOME_ALTITUDE_M - motion.position_m[2],
        -v_down,
    )


def home_position(view: VehicleView) -> Message | None:
    """HOME_POSITION; None where the position was not known when the vehicle was armed."""
    home = view.home
    if not all(map(math.isfinite, home.position_m)):
        return None
    north, east, down = home.position_m
    latitude, longitude, above_sea = geographic_position((east, north, -down))
    return dialect.MAVLink_home_position_message(
        int32(latitude * 1e7),
        int32(longitude * 1e7),
        int32(above_sea * 1e3),
        north,
        east,
        down,
        home.quaternion,
        0.0,
        0.0,
        0.0,
        microseconds(home.time_s),
    )


def global_origin(view: VehicleView) -> Message:
    """GPS_GLOBAL_ORIGIN: where the local frame has its zero."""
    return dialect.MAVLink_gps_global_origin_message(
        round(HOME_LATITUDE_DEG * 1e7),
        round(HOME_LONGITUDE_DEG * 1e7),
        round(HOME_ALTITUDE_M * 1e3),
        microseconds(view.time_s),
    )


def truth(view: VehicleView) -> Message:
    """DEBUG_FLOAT_ARRAY named "truth": uasfly's own addition, for summaries of simulated flights.

    `time_usec` is vehicle time since boot; `data` holds the fields of `uasfly.messages.TruthSample` in their order, in
    ENU and FLU: position (3) m, velocity (3) m/s, quaternion body to world (4, w first), force of the wind (3) m/s^2,
    wind at the vehicle (3) m/s; then zeros.
    """
    sample = view.vehicle.truth()
    data = [
        *sample.position_in_world.tolist(),
        *sample.velocity_in_world.tolist(),
        *sample.quaternion_body_to_world.tolist(),
        *sample.force_in_world.tolist(),
        *sample.wind_in_world.tolist(),
    ]
    return dialect.MAVLink_debug_float_array_message(
        microseconds(sample.time_s), b"truth", 0, data + [0.0] * (58 - len(data))
    )
