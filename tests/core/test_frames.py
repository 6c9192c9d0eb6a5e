"""Frames: both conventions are right, and going there and back changes nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from uasfly import frames

angles = st.floats(-3.1, 3.1)
tilts = st.floats(-1.5, 1.5)


@given(tilts, tilts, angles)
def test_euler_angles_survive_the_round_trip(roll: float, pitch: float, yaw: float) -> None:
    """Euler to quaternion to Euler gives the same angles."""
    quaternion = frames.quaternion_from_euler(roll, pitch, yaw)
    assert frames.euler_from_quaternion(quaternion) == pytest.approx((roll, pitch, yaw), abs=1e-9)


@given(tilts, tilts, angles)
def test_rotation_matrix_is_the_product_of_the_elementary_rotations(roll: float, pitch: float, yaw: float) -> None:
    """R = Rz(yaw) Ry(pitch) Rx(roll), written out independently of the quaternion."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    expected = rz @ ry @ rx
    np.testing.assert_allclose(
        frames.rotation_matrix(frames.quaternion_from_euler(roll, pitch, yaw)), expected, atol=1e-12
    )


@given(tilts, tilts, angles)
def test_ned_attitude_rotates_frd_vectors_like_the_enu_attitude_rotates_flu_vectors(
    roll: float, pitch: float, yaw: float
) -> None:
    """The swapped attitude carries a swapped body vector to the swapped world vector."""
    attitude = frames.quaternion_from_euler(roll, pitch, yaw)
    vector = np.array([0.3, -1.2, 2.0])
    direct = frames.swap_enu_ned(frames.rotation_matrix(attitude) @ vector)
    swapped = frames.rotation_matrix(frames.swap_quaternion_enu_ned(attitude)) @ frames.swap_flu_frd(vector)
    np.testing.assert_allclose(direct, swapped, atol=1e-12)


@given(tilts, tilts, angles)
def test_ned_euler_angles_keep_roll_and_flip_pitch(roll: float, pitch: float, yaw: float) -> None:
    """In FRD/NED a roll to the right stays, nose up changes sign, and yaw counts clockwise from north."""
    swapped = frames.swap_quaternion_enu_ned(frames.quaternion_from_euler(roll, pitch, yaw))
    r, p, y = frames.euler_from_quaternion(swapped)
    assert (r, p) == pytest.approx((roll, -pitch), abs=1e-9)
    assert frames.wrap_angle(y - frames.swap_yaw_enu_ned(yaw)) == pytest.approx(0.0, abs=1e-9)


def test_east_in_enu_is_the_second_axis_of_ned() -> None:
    """The world axes are what their names say."""
    np.testing.assert_array_equal(frames.swap_enu_ned(np.array([1.0, 0.0, 0.0])), [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(frames.swap_enu_ned(np.array([0.0, 0.0, 1.0])), [0.0, 0.0, -1.0])
    assert frames.swap_yaw_enu_ned(0.0) == pytest.approx(math.pi / 2)


@given(st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3))
def test_rotation_vectors_survive_the_round_trip(vector: list[float]) -> None:
    """Exponential and logarithm are inverse to each other below half a turn, also near zero."""
    quaternion = frames.quaternion_from_rotation_vector(np.array(vector))
    assert float(quaternion @ quaternion) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(frames.rotation_vector_from_quaternion(quaternion), vector, atol=1e-9)


@given(st.floats(-100.0, 100.0))
def test_wrapped_angles_differ_by_whole_turns(angle: float) -> None:
    """Wrapping keeps the direction and lands in [-pi, pi)."""
    wrapped = frames.wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.remainder(wrapped - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_quaternion_product_composes_rotations() -> None:
    """R(a b) = R(a) R(b), and the inverse undoes it."""
    a = frames.quaternion_from_euler(0.2, -0.4, 1.0)
    b = frames.quaternion_from_euler(-0.7, 0.1, 2.0)
    product = frames.quaternion_product(a, b)
    expected = frames.rotation_matrix(a) @ frames.rotation_matrix(b)
    np.testing.assert_allclose(frames.rotation_matrix(product), expected, atol=1e-12)
    identity = frames.quaternion_product(product, frames.quaternion_inverse(product))
    np.testing.assert_allclose(identity, [1, 0, 0, 0], atol=1e-15)


def test_skew_gives_the_cross_product() -> None:
    """skew(a) b = a x b."""
    a, b = np.array([1.0, 2.0, 3.0]), np.array([-0.5, 0.4, 2.0])
    np.testing.assert_allclose(frames.skew(a) @ b, np.cross(a, b))
