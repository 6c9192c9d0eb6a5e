"""True state where a simulation tells it: our own vehicle as a DEBUG_FLOAT_ARRAY, PX4's SIH as HIL_STATE_QUATERNION."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from uasfly.frames import swap_enu_ned, swap_quaternion_enu_ned
from uasfly.link.motion import finite, unit_quaternion
from uasfly.messages import Array, TruthSample

Fields = Mapping[str, Any]

TRUTH_NAME = "truth"
EARTH_RADIUS_M = 6371000.0  # as in PX4's map projection

# Layout of the array: world ENU, body FLU, SI.
POSITION = slice(0, 3)  # m
VELOCITY = slice(3, 6)  # m/s
QUATERNION = slice(6, 10)  # w first, body to world
FORCE = slice(10, 13)  # m/s^2, mass-normalised
WIND = slice(13, 16)  # m/s
LENGTH = 16


def simulated_truth(fields: Fields, time_s: float) -> TruthSample | None:
    """DEBUG_FLOAT_ARRAY named "truth" of uasfly's simulated vehicle; None for any other array."""
    if fields["name"] != TRUTH_NAME:
        return None
    values = fields["data"][:LENGTH]
    quaternion = unit_quaternion(values[QUATERNION])
    if None in values or quaternion is None:
        return None
    data = finite(values)
    if data is None:
        return None
    return TruthSample(time_s, data[POSITION], data[VELOCITY], quaternion, data[FORCE], data[WIND])


class GeographicTruth:
    """HIL_STATE_QUATERNION (PX4's SIH) relative to the estimator's origin (GPS_GLOBAL_ORIGIN).

    Its resolution is 1.1 cm (degrees times 1e7); wind and wind force are unknown (NaN).
    """

    def __init__(self) -> None:
        self._origin: tuple[float, float, float] | None = None  # rad, rad, m

    def set_origin(self, fields: Fields) -> None:
        """GPS_GLOBAL_ORIGIN."""
        self._origin = (
            math.radians(fields["latitude"] * 1e-7),
            math.radians(fields["longitude"] * 1e-7),
            fields["altitude"] * 1e-3,
        )

    def sample(self, fields: Fields, time_s: float) -> TruthSample | None:
        """HIL_STATE_QUATERNION; None before the origin is known."""
        quaternion = unit_quaternion(fields["attitude_quaternion"])
        if self._origin is None or quaternion is None:
            return None
        velocity, position = finite((fields["vx"], fields["vy"], fields["vz"])), self._position(fields, self._origin)
        if velocity is None or position is None:
            return None
        unknown = np.full(3, math.nan)
        return TruthSample(
            time_s,
            position,
            swap_enu_ned(velocity * 1e-2),
            swap_quaternion_enu_ned(quaternion),
            unknown,
            unknown,
        )

    @staticmethod
    def _position(fields: Fields, origin: tuple[float, float, float]) -> Array | None:
        """ENU position [m] on the sphere, flat: 1 mm off at 300 m; None where it is not finite."""
        latitude, longitude = math.radians(fields["lat"] * 1e-7), math.radians(fields["lon"] * 1e-7)
        east = EARTH_RADIUS_M * math.cos(origin[0]) * (longitude - origin[1])
        north = EARTH_RADIUS_M * (latitude - origin[0])
        return finite((east, north, fields["alt"] * 1e-3 - origin[2]))
