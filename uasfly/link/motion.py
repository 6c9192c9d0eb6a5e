"""ODOMETRY, ATTITUDE_TARGET and BATTERY_STATUS as samples: NED/FRD becomes ENU/FLU here.

The functions return None for a message that cannot be used: mavlink_direct delivers NaN and Inf as null.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from operator import itemgetter
from typing import Any

import numpy as np

from uasfly.frames import rotation_matrix, swap_enu_ned, swap_flu_frd, swap_quaternion_enu_ned
from uasfly.messages import Array, AttitudeTargetSample, BatterySample, OdometrySample

Fields = Mapping[str, Any]

FRAME_LOCAL_NED = 1  # MAV_FRAME
NORM_TOLERANCE = 0.01
_odometry = itemgetter("x", "y", "z", "vx", "vy", "vz", "rollspeed", "pitchspeed", "yawspeed")
CELL_UNKNOWN_MV = 65535


def odometry_sample(fields: Fields, time_s: float) -> OdometrySample | None:
    """ODOMETRY in the frame LOCAL_NED; the velocity is in the child frame: LOCAL_NED as PX4 sends it, else body FRD."""
    if fields["frame_id"] != FRAME_LOCAL_NED:
        return None
    numbers = _odometry(fields)
    quaternion = unit_quaternion(fields["q"])
    if quaternion is None or None in numbers or not math.isfinite(sum(numbers)):
        return None
    motion = np.array(numbers, dtype=np.float64)
    position, velocity, rate = motion[0:3], motion[3:6], motion[6:9]
    if fields["child_frame_id"] != FRAME_LOCAL_NED:
        velocity = rotation_matrix(quaternion) @ velocity
    return OdometrySample(
        time_s,
        swap_enu_ned(position),
        swap_enu_ned(velocity),
        swap_quaternion_enu_ned(quaternion),
        swap_flu_frd(rate),
        int(fields["reset_counter"]),
    )


def attitude_target_sample(fields: Fields, time_s: float) -> AttitudeTargetSample | None:
    """ATTITUDE_TARGET: what PX4's attitude controller is asked for."""
    quaternion, thrust = unit_quaternion(fields["q"]), fields["thrust"]
    if quaternion is None or thrust is None or not math.isfinite(thrust):
        return None
    return AttitudeTargetSample(time_s, swap_quaternion_enu_ned(quaternion), float(thrust))


def battery_sample(fields: Fields, time_s: float) -> BatterySample | None:
    """BATTERY_STATUS: the cells' sum (or the whole voltage in the first one), as far as they are known."""
    cells = [cell for cell in fields["voltages"] if cell is not None and cell != CELL_UNKNOWN_MV]
    cells += [cell for cell in fields.get("voltages_ext", ()) if cell]  # here 0 means unknown
    voltage_v = sum(cells) * 1e-3
    if not 0.0 < voltage_v < math.inf:
        return None
    percent = fields["battery_remaining"]
    return BatterySample(time_s, voltage_v, math.nan if percent < 0 else percent * 1e-2)


def unit_quaternion(values: Any) -> Array | None:
    """Four numbers as a unit quaternion (4,); None when one is missing or the norm is not near 1."""
    if None in values:
        return None
    w, x, y, z = values
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return np.array((w / norm, x / norm, y / norm, z / norm)) if abs(norm - 1.0) < NORM_TOLERANCE else None


def finite(values: Any) -> Array | None:
    """Numbers as an array; None where one is not finite."""
    array = np.array(values, dtype=np.float64)
    return array if np.isfinite(array).all() else None
