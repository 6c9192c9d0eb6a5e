"""Messages to the vehicle: frames, completeness, limits."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from uasfly.link import encode, modes
from uasfly.link.motion import attitude_target_sample
from uasfly.messages import FlightMode, RequestKind, Setpoint

ENU_TO_NED = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
FRD_TO_FLU = np.diag((1.0, -1.0, -1.0))

angles = st.floats(-math.pi, math.pi)
tilts = st.floats(-1.2, 1.2)


def rotation(axis: int, angle: float) -> NDArray[np.float64]:
    """Elementary rotation matrix, written out."""
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[first, first] = matrix[second, second] = c
    matrix[first, second], matrix[second, first] = -s, s
    return matrix


def matrix_of(q: list[float]) -> NDArray[np.float64]:
    """Rotation matrix from a quaternion by q v q^-1 of the unit vectors, as quaternion products of 4x4 matrices."""
    w, x, y, z = q
    left = np.array(((w, -x, -y, -z), (x, w, -z, y), (y, z, w, -x), (z, -y, x, w)))
    right = np.array(((w, x, y, z), (-x, w, -z, y), (-y, z, w, -x), (-z, -y, x, w)))
    product: NDArray[np.float64] = (left @ right)[1:, 1:]
    return product


@settings(deadline=None)
@given(roll=tilts, pitch=tilts, yaw=angles)
def test_the_attitude_on_the_wire_is_the_setpoint_in_ned_and_frd(roll: float, pitch: float, yaw: float) -> None:
    """Against rotation matrices that are multiplied out independently: R_ned = T R_enu S."""
    fields = json.loads(encode.attitude_target(Setpoint(0.0, roll, pitch, yaw, 0.0, 0.5), 1, 0.0))
    in_enu = rotation(2, yaw) @ rotation(1, pitch) @ rotation(0, roll)
    np.testing.assert_allclose(matrix_of(fields["q"]), ENU_TO_NED @ in_enu @ FRD_TO_FLU, atol=1e-12)


@settings(deadline=None)
@given(roll=tilts, pitch=tilts, yaw=angles)
def test_an_attitude_comes_back_as_it_went(roll: float, pitch: float, yaw: float) -> None:
    """Setpoint to wire to AttitudeTargetSample is the identity."""
    fields = json.loads(encode.attitude_target(Setpoint(0.0, roll, pitch, yaw, 0.0, 0.5), 1, 0.0))
    sample = attitude_target_sample(fields, 1.0)
    assert sample is not None
    expected = rotation(2, yaw) @ rotation(1, pitch) @ rotation(0, roll)
    np.testing.assert_allclose(matrix_of(sample.quaternion_body_to_world.tolist()), expected, atol=1e-12)


def test_facing_north_nose_down_is_what_px4_calls_negative_pitch() -> None:
    """ENU yaw 90 deg with FLU pitch +10 deg (nose down) is NED yaw 0, FRD pitch -10 deg."""
    setpoint = Setpoint(0.0, 0.0, math.radians(10.0), math.radians(90.0), 0.0, 0.5)
    w, x, y, z = json.loads(encode.attitude_target(setpoint, 1, 0.0))["q"]
    np.testing.assert_allclose(
        (w, x, y, z), (math.cos(math.radians(5.0)), 0.0, -math.sin(math.radians(5.0)), 0.0), atol=1e-12
    )


def test_a_setpoint_message_is_complete() -> None:
    """Every field of SET_ATTITUDE_TARGET is there: mavlink_direct would send 0 for a missing one."""
    fields = json.loads(encode.attitude_target(Setpoint(0.0, 0.0, 0.0, 0.0, 0.25, 1.0), 9, 12.3456))
    assert set(fields) == {
        "target_system", "target_component", "time_boot_ms", "type_mask", "q",
        "body_roll_rate", "body_pitch_rate", "body_yaw_rate", "thrust", "thrust_body",
    }  # fmt: skip
    assert (fields["target_system"], fields["target_component"], fields["type_mask"]) == (9, 1, 3)
    assert (fields["time_boot_ms"], fields["body_yaw_rate"], fields["thrust"]) == (12345, -0.25, 1.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("position", range(1, 6))
def test_no_field_that_is_not_finite_leaves(position: int, value: float) -> None:
    """In any of the five fields."""
    fields = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    fields[position] = value
    with pytest.raises(ValueError, match="finite"):
        encode.attitude_target(Setpoint(*fields), 1, 0.0)


@pytest.mark.parametrize("thrust", [-1e-9, 1.0 + 1e-9, 5.0])
def test_no_thrust_outside_its_range_leaves(thrust: float) -> None:
    """PX4's receiver does not clip it."""
    with pytest.raises(ValueError, match=r"0\.\.1"):
        encode.attitude_target(Setpoint(0.0, 0.0, 0.0, 0.0, 0.0, thrust), 1, 0.0)


def test_commands_carry_all_seven_parameters() -> None:
    """Those that are not given are 0, none can be NaN."""
    fields = json.loads(encode.command_long(3, 400, (1.0,), 2))
    assert [fields[f"param{index}"] for index in range(1, 8)] == [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert (fields["command"], fields["target_system"], fields["target_component"], fields["confirmation"]) == (
        400,
        3,
        1,
        2,
    )
    with pytest.raises(ValueError, match="JSON"):
        encode.command_long(3, 400, (math.nan,), 0)
    with pytest.raises(ValueError, match="JSON"):
        encode.parameter_set(3, "MIS_TAKEOFF_ALT", math.inf)


@settings(deadline=None, max_examples=40)
@given(st.text(max_size=220), st.integers(1, 65535))
def test_long_texts_are_cut_into_chunks_that_join_again(text: str, identity: int) -> None:
    """Chunks of at most 50 bytes, numbered, with one id; the last one is not full."""
    messages: list[dict[str, Any]] = [json.loads(message) for message in encode.status_texts(4, text, identity)]
    joined = "".join(message["text"] for message in messages)
    assert joined == (text.encode("ascii", "replace").decode() or " ")
    assert [message["chunk_seq"] for message in messages] == list(range(len(messages)))
    assert {message["id"] for message in messages} == {identity if len(messages) > 1 else 0}
    if len(messages) > 1:
        assert all(len(message["text"]) == 50 for message in messages[:-1])
        assert len(messages[-1]["text"]) < 50


def test_a_severity_must_exist() -> None:
    """0..7."""
    with pytest.raises(ValueError, match="severity"):
        encode.status_texts(8, "x", 1)


@pytest.mark.parametrize(
    ("main", "sub", "mode"),
    [
        (1, 0, FlightMode.OTHER),
        (2, 0, FlightMode.OTHER),
        (3, 0, FlightMode.POSITION),
        (4, 2, FlightMode.TAKEOFF),
        (4, 3, FlightMode.HOLD),
        (4, 4, FlightMode.OTHER),
        (4, 5, FlightMode.RETURN),
        (4, 6, FlightMode.LAND),
        (4, 20, FlightMode.DESCEND),
        (6, 0, FlightMode.OFFBOARD),
        (7, 0, FlightMode.OTHER),
    ],
)
def test_px4s_custom_modes(main: int, sub: int, mode: FlightMode) -> None:
    """Main mode in bits 16..23, sub mode in bits 24..31."""
    assert modes.flight_mode(main << 16 | sub << 24) is mode


def test_a_mode_that_is_asked_for_is_the_mode_that_is_shown() -> None:
    """The table of commands and the table of modes agree; arming is not forced (21196 in parameter 2)."""
    shown = {
        RequestKind.TAKEOFF: FlightMode.TAKEOFF,
        RequestKind.OFFBOARD: FlightMode.OFFBOARD,
        RequestKind.HOLD: FlightMode.HOLD,
        RequestKind.LAND: FlightMode.LAND,
        RequestKind.RETURN: FlightMode.RETURN,
    }
    for kind in RequestKind:
        number, parameters = modes.command_of(kind)
        if kind in shown:
            main, sub = (int(value) for value in (*parameters[1:], 0.0)[:2])
            assert (number, parameters[0]) == (176, 1.0)
            assert modes.flight_mode(main << 16 | sub << 24) is shown[kind]
        else:
            assert (number, parameters) == (400, (1.0 if kind is RequestKind.ARM else 0.0,))
