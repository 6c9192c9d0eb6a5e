"""What goes to the vehicle, as the JSON that mavlink_direct sends: ENU/FLU becomes NED/FRD here.

mavlink_direct turns a missing field into 0, ignores a wrong name, wraps integers and sends null as NaN, all without an
error; so every message is complete and every number is checked here.
"""

from __future__ import annotations

import json
import math

from uasfly.frames import quaternion_from_euler, swap_quaternion_enu_ned
from uasfly.messages import Setpoint
from uasfly.wind_messages import WindEstimate

AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1
COMPANION = 195  # the component id that MAVSDK gives a companion computer
ATTITUDE_THRUST_AND_YAW_RATE = 3  # type_mask: ignore body roll and pitch rate
PARAMETER_REAL32 = 9  # MAV_PARAM_TYPE_REAL32
BY_NAME = -1  # param_index of a request that names its parameter
TEXT_BYTES = 50  # STATUSTEXT carries this much; more goes in chunks

_ATTITUDE_TARGET = (
    '{"target_system":%d,"target_component":%d,"time_boot_ms":%d,"type_mask":%d,"q":[%r,%r,%r,%r],'
    '"body_roll_rate":0.0,"body_pitch_rate":0.0,"body_yaw_rate":%r,"thrust":%r,"thrust_body":[0.0,0.0,0.0]}'
)


def check_setpoint(setpoint: Setpoint) -> None:
    """Refuse a setpoint that must not leave.

    Raises:
        ValueError: when a field is not finite or the thrust is outside 0..1.
    """
    fields = (setpoint.roll_rad, setpoint.pitch_rad, setpoint.yaw_rad, setpoint.yaw_rate_rad_s, setpoint.thrust)
    if not all(map(math.isfinite, fields)):
        raise ValueError(f"a setpoint must be finite, found {setpoint}")
    if not 0.0 <= setpoint.thrust <= 1.0:
        raise ValueError(f"thrust must lie in 0..1, found {setpoint.thrust}")


def attitude_target(setpoint: Setpoint, system_id: int, vehicle_time_s: float) -> str:
    """SET_ATTITUDE_TARGET with attitude, thrust and yaw-rate feed-forward (type mask 3).

    Args:
        setpoint: ENU/FLU angles and yaw rate [rad, rad/s], thrust 0..1.
        system_id: the vehicle's.
        vehicle_time_s: the setpoint's time on the vehicle's clock, 0 where it is not known.

    Raises:
        ValueError: see `check_setpoint`.
    """
    check_setpoint(setpoint)
    quaternion = swap_quaternion_enu_ned(
        quaternion_from_euler(setpoint.roll_rad, setpoint.pitch_rad, setpoint.yaw_rad)
    ).tolist()
    boot_ms = int(vehicle_time_s * 1e3) & 0xFFFFFFFF
    yaw_rate = -float(setpoint.yaw_rate_rad_s)  # ENU counts yaw counter-clockwise, NED clockwise
    thrust = float(setpoint.thrust)
    mask = ATTITUDE_THRUST_AND_YAW_RATE
    return _ATTITUDE_TARGET % (system_id, AUTOPILOT, boot_ms, mask, *quaternion, yaw_rate, thrust)


def command_long(system_id: int, command: int, parameters: tuple[float, ...], confirmation: int) -> str:
    """COMMAND_LONG to the autopilot; parameters that are not given are 0."""
    fields: dict[str, float | int] = {
        "target_system": system_id,
        "target_component": AUTOPILOT,
        "command": command,
        "confirmation": confirmation,
    }
    padded = (*parameters, *(0.0,) * (7 - len(parameters)))
    fields.update({f"param{index}": float(value) for index, value in enumerate(padded, start=1)})
    return json.dumps(fields, allow_nan=False)


def parameter_set(system_id: int, name: str, value: float) -> str:
    """PARAM_SET of a floating-point parameter."""
    fields = {
        "target_system": system_id,
        "target_component": AUTOPILOT,
        "param_id": name,
        "param_value": float(value),
        "param_type": PARAMETER_REAL32,
    }
    return json.dumps(fields, allow_nan=False)


def parameter_request(system_id: int, name: str) -> str:
    """PARAM_REQUEST_READ of a parameter by its name."""
    return json.dumps(
        {"target_system": system_id, "target_component": AUTOPILOT, "param_id": name, "param_index": BY_NAME}
    )


def time_request(system_id: int, sent_ns: int) -> str:
    """TIMESYNC request: the vehicle returns `sent_ns` with its own time."""
    return json.dumps({"tc1": 0, "ts1": sent_ns, "target_system": system_id, "target_component": AUTOPILOT})


def wind_covariance(wind: WindEstimate, vehicle_time_s: float) -> str:
    """WIND_COV with the mean wind, as ground stations show it: NED, towards where the air moves.

    The vertical wind is not known: NaN, with an accuracy of 0, which stands for unknown there. The altitude above the
    sea is not known here either.

    Args:
        wind: the estimate, finite.
        vehicle_time_s: its time on the vehicle's clock, 0 where it is not known.

    Raises:
        ValueError: when speed or sigma is not finite.
    """
    east, north = wind.mean_in_world.tolist()
    accuracy, gustiness = wind.mean_speed_sigma_m_s, wind.variability_m_s
    if not all(map(math.isfinite, (east, north, accuracy, gustiness))):
        raise ValueError(f"a wind must be finite, found {wind}")
    fields = {
        "time_usec": max(0, int(vehicle_time_s * 1e6)),
        "wind_x": north,
        "wind_y": east,
        "wind_z": None,  # mavlink_direct sends null as NaN
        "var_horiz": gustiness,
        "var_vert": None,
        "wind_alt": None,
        "horiz_accuracy": accuracy,
        "vert_accuracy": 0.0,
    }
    return json.dumps(fields, allow_nan=False)


def status_texts(severity: int, text: str, message_id: int) -> list[str]:
    """STATUSTEXT messages of a text of any length, in chunks of 50 bytes that the receiver joins by `message_id`.

    Args:
        severity: 0 emergency .. 7 debug.
        text: what to say; characters beyond ASCII become "?", because ground stations disagree about them.
        message_id: 1..65535, different for consecutive long texts.
    """
    if not 0 <= severity <= 7:
        raise ValueError(f"severity must lie in 0..7, found {severity}")
    plain = text.encode("ascii", "replace").decode("ascii") or " "
    chunks = [plain[start : start + TEXT_BYTES] for start in range(0, len(plain), TEXT_BYTES)]
    if len(chunks) > 1 and len(chunks[-1]) == TEXT_BYTES:
        chunks.append("")  # a chunk that is not full ends the text
    identity = message_id if len(chunks) > 1 else 0
    return [
        json.dumps({"severity": severity, "text": chunk, "id": identity, "chunk_seq": index})
        for index, chunk in enumerate(chunks)
    ]
