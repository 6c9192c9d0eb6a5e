"""Telemetry of the raw sensors, field by field as PX4 fills it (main of August 2026)."""

from __future__ import annotations

import math
import struct

from pymavlink.dialects.v20 import development as dialect

from uasfly.frames import swap_enu_ned, swap_flu_frd
from uasfly.sim.mavlink.framing import Message, UnlistedMessage
from uasfly.sim.mavlink.motion_messages import int32, microseconds, milliseconds
from uasfly.sim.mavlink.vehicle_view import VehicleView
from uasfly.sim.sensors import GnssSample

TEMPERATURE_C = 15.0
GNSS_LOST_INTERVAL_S = 1.0
# fields of HIGHRES_IMU that are new: accelerometer, gyro, magnetometer, barometer
_FIELDS_UPDATED = 0x3F | 0x1C0 | 0x1A00
_LARGEST_U32 = 0xFFFFFFFF
_UNKNOWN_U16, _UNKNOWN_U8 = 0xFFFF, 0xFF
ESC_STATUS_ID, _ESC_STATUS_CRC_EXTRA = 291, 10
_ESC_STATUS = struct.Struct("<Q4i8fB")  # time [us], speeds [rpm], voltages [V] and currents [A], index of the first
_ESC_BATCH = 4  # rotors in one ESC_STATUS
_UNTOLD = (0.0,) * 8  # voltages and currents
_RPM = 60.0 / (2.0 * math.pi)  # of 1 rad/s
_EPH, _EPV = 70, 110  # dilution of precision times 100, and
_VELOCITY_ACCURACY_MM_S = 400  # accuracy of PX4's simulated receiver


def highres_imu(view: VehicleView) -> Message | None:
    """HIGHRES_IMU; None where the inertial unit says nothing."""
    sample = view.vehicle.inertial()
    if sample is None:
        return None
    return dialect.MAVLink_highres_imu_message(
        microseconds(sample.time_s),
        *swap_flu_frd(sample.acceleration_in_body).tolist(),
        *swap_flu_frd(sample.angular_rate_in_body).tolist(),
        *swap_flu_frd(sample.magnetic_field_in_body).tolist(),
        pressure_of_altitude_hpa(sample.pressure_altitude_m),
        0.0,
        sample.pressure_altitude_m,
        TEMPERATURE_C,
        _FIELDS_UPDATED,
        0,
    )


def scaled_pressure(view: VehicleView) -> Message | None:
    """SCALED_PRESSURE; None where the inertial unit, whose barometer it is, says nothing."""
    sample = view.vehicle.inertial()
    if sample is None:
        return None
    pressure = pressure_of_altitude_hpa(sample.pressure_altitude_m)
    return dialect.MAVLink_scaled_pressure_message(
        milliseconds(sample.time_s), pressure, 0.0, round(TEMPERATURE_C * 100.0), 0
    )


def esc_status(view: VehicleView) -> tuple[Message, ...] | None:
    """ESC_STATUS, four rotors a message; None where the speed controllers tell nothing. PX4 fills up with zeros."""
    sample = view.vehicle.rotors()
    if sample is None:
        return None
    rpm = [round(speed * _RPM) for speed in sample.speeds_rad_s.tolist()]
    rpm += [0] * (-len(rpm) % _ESC_BATCH)
    return tuple(
        UnlistedMessage(
            ESC_STATUS_ID,
            "ESC_STATUS",
            _ESC_STATUS_CRC_EXTRA,
            _ESC_STATUS.pack(microseconds(sample.time_s), *rpm[index : index + _ESC_BATCH], *_UNTOLD, index),
        )
        for index in range(0, len(rpm), _ESC_BATCH)
    )


class Gnss:
    """GPS_RAW_INT: what the receiver says; without a fix an empty message once a second."""

    def __init__(self) -> None:
        self._sent_s = -math.inf

    def __call__(self, view: VehicleView) -> Message | None:
        """Build the message; None where a receiver without a fix has nothing to say yet."""
        sample = view.vehicle.gnss()
        if sample.fix == 0 and sample.time_s - self._sent_s < GNSS_LOST_INTERVAL_S:
            return None
        self._sent_s = sample.time_s
        return _no_fix() if sample.fix == 0 else _fix(sample)


def pressure_of_altitude_hpa(altitude_m: float) -> float:
    """Air pressure in the ICAO standard atmosphere below 11 km."""
    return 1013.25 * math.pow(max(0.0, 1.0 - 2.25577e-5 * altitude_m), 5.25588)


def _fix(sample: GnssSample) -> Message:
    v_north, v_east, v_down = swap_enu_ned(sample.velocity_in_world).tolist()
    altitude_mm = int32(round(sample.altitude_m * 1e3))
    speed = math.sqrt(v_north * v_north + v_east * v_east + v_down * v_down)
    return dialect.MAVLink_gps_raw_int_message(
        microseconds(sample.time_s),
        sample.fix,
        int32(round(sample.latitude_deg * 1e7)),
        int32(round(sample.longitude_deg * 1e7)),
        altitude_mm,
        _EPH,
        _EPV,
        min(_UNKNOWN_U16 - 1, int(speed * 100.0)),
        int(math.degrees(math.atan2(v_east, v_north)) % 360.0 * 100.0) % 36000,
        sample.satellites,
        altitude_mm,
        min(_LARGEST_U32, round(sample.horizontal_accuracy_m * 1e3)),
        min(_LARGEST_U32, round(sample.vertical_accuracy_m * 1e3)),
        _VELOCITY_ACCURACY_MM_S,
    )


def _no_fix() -> Message:
    return dialect.MAVLink_gps_raw_int_message(
        0, 0, 0, 0, 0, _UNKNOWN_U16, _UNKNOWN_U16, _UNKNOWN_U16, _UNKNOWN_U16, _UNKNOWN_U8
    )
