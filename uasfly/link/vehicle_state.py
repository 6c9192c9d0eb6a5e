"""Samples that several messages make up together: mode and arming, estimator and GNSS."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from uasfly.link.modes import MODE_FLAG_ARMED, flight_mode
from uasfly.messages import FlightMode, HealthSample, VehicleSample

Fields = Mapping[str, Any]

# ESTIMATOR_STATUS_FLAGS
ATTITUDE = 1
VELOCITY_HORIZONTAL = 2
VELOCITY_VERTICAL = 4
POSITION_HORIZONTAL_RELATIVE = 8
POSITION_HORIZONTAL_ABSOLUTE = 16
POSITION_VERTICAL_ABSOLUTE = 32

LANDED_ON_GROUND = 1  # MAV_LANDED_STATE; 2 in the air, 3 taking off, 4 landing
IN_AIR_STATES = frozenset({2, 3, 4})
SATELLITES_UNKNOWN = 255


class VehicleState:
    """Mode, arming and landed state.

    From HEARTBEAT (1 Hz), CURRENT_MODE (at once on a change) and EXTENDED_SYS_STATE.
    """

    def __init__(self) -> None:
        self._heartbeat_s = math.nan
        self._mode = FlightMode.OTHER
        self._armed = False
        self._in_air = False

    @property
    def heartbeat_s(self) -> float:
        """Arrival of the last heartbeat, NaN before the first."""
        return self._heartbeat_s

    def heartbeat(self, fields: Fields, arrival_s: float) -> VehicleSample:
        """HEARTBEAT of the autopilot."""
        self._heartbeat_s = arrival_s
        self._mode = flight_mode(int(fields["custom_mode"]))
        self._armed = bool(int(fields["base_mode"]) & MODE_FLAG_ARMED)
        return self._sample()

    def current_mode(self, fields: Fields) -> VehicleSample | None:
        """CURRENT_MODE: a sample when the mode has changed."""
        mode = flight_mode(int(fields["custom_mode"]))
        changed, self._mode = mode is not self._mode, mode
        return self._sample_once_heard(changed)

    def landed_state(self, fields: Fields) -> VehicleSample | None:
        """EXTENDED_SYS_STATE: a sample when the vehicle has left the ground or come back to it."""
        landed = int(fields["landed_state"])
        if landed != LANDED_ON_GROUND and landed not in IN_AIR_STATES:
            return None
        in_air = landed in IN_AIR_STATES
        changed, self._in_air = in_air is not self._in_air, in_air
        return self._sample_once_heard(changed)

    def _sample_once_heard(self, changed: bool) -> VehicleSample | None:
        return self._sample() if changed and not math.isnan(self._heartbeat_s) else None

    def _sample(self) -> VehicleSample:
        return VehicleSample(self._heartbeat_s, self._mode, self._armed, self._in_air)


class HealthState:
    """Estimator flags and accuracy from ESTIMATOR_STATUS, fix and satellites from GPS_RAW_INT."""

    def __init__(self) -> None:
        self._flags: int | None = None
        self._accuracy_m = math.nan
        self._fix = 0
        self._satellites = 0

    def estimator(self, fields: Fields, time_s: float) -> HealthSample:
        """ESTIMATOR_STATUS."""
        self._flags = int(fields["flags"])
        accuracy = fields["pos_horiz_accuracy"]
        self._accuracy_m = math.nan if accuracy is None else float(accuracy)
        return self._sample(self._flags, time_s)

    def gnss(self, fields: Fields, time_s: float) -> HealthSample | None:
        """GPS_RAW_INT: a sample when the fix has changed and the estimator has been heard."""
        fix, satellites = int(fields["fix_type"]), int(fields["satellites_visible"])
        changed, self._fix = fix != self._fix, fix
        self._satellites = 0 if satellites == SATELLITES_UNKNOWN else satellites
        return self._sample(self._flags, time_s) if changed and self._flags is not None else None

    def _sample(self, flags: int, time_s: float) -> HealthSample:
        horizontal = flags & (POSITION_HORIZONTAL_RELATIVE | POSITION_HORIZONTAL_ABSOLUTE)
        position = bool(horizontal and flags & POSITION_VERTICAL_ABSOLUTE)  # the flag of constant position is no hint:
        # PX4 sets it at rest with good GNSS too
        velocity = bool(flags & VELOCITY_HORIZONTAL and flags & VELOCITY_VERTICAL)
        return HealthSample(
            time_s, position, velocity, bool(flags & ATTITUDE), self._fix, self._satellites, self._accuracy_m
        )
