"""ENU/FLU <-> NED/FRD, quaternions and angle wrapping: the only place that knows both conventions.

Quaternions are Hamilton, w first; `quaternion_body_to_world` rotates body vectors into the world.
The functions are plain float arithmetic on small arrays: at 50-250 Hz the overhead of matrix helpers would dominate.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array

TWO_PI = 2.0 * math.pi
_HALF_SQRT2 = math.sqrt(0.5)


def wrap_angle(angle_rad: float) -> float:
    """Angle wrapped to [-pi, pi)."""
    return (angle_rad + math.pi) % TWO_PI - math.pi


def quaternion_product(left: Array, right: Array) -> Array:
    """Hamilton product of two (4,) quaternions."""
    w1, x1, y1, z1 = left.tolist()
    w2, x2, y2, z2 = right.tolist()
    return np.array(
        (
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        )
    )


def quaternion_inverse(quaternion: Array) -> Array:
    """Inverse of a unit quaternion (4,)."""
    w, x, y, z = quaternion.tolist()
    return np.array((w, -x, -y, -z))


def quaternion_from_rotation_vector(rotation_vector_rad: Array) -> Array:
    """Exponential map: (3,) rotation vector [rad] to a unit quaternion (4,)."""
    x, y, z = rotation_vector_rad.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    half = 0.5 * angle
    scale = 0.5 - angle * angle / 48.0 if angle < 1e-6 else math.sin(half) / angle
    return np.array((math.cos(half), scale * x, scale * y, scale * z))


def rotation_vector_from_quaternion(quaternion: Array) -> Array:
    """Logarithm map: unit quaternion (4,) to the shortest rotation vector (3,) [rad]."""
    w, x, y, z = quaternion.tolist()
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if norm < 1e-9 else 2.0 * math.atan2(norm, w) / norm
    return np.array((scale * x, scale * y, scale * z))


def rotation_matrix(quaternion: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion (4,): takes what the quaternion takes, body vectors to the world."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def euler_from_quaternion(quaternion: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of the Z-Y-X convention from a unit quaternion (4,)."""
    w, x, y, z = quaternion.tolist()
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2 * (w * y - x * z))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Array:
    """Unit quaternion (4,) of Z-Y-X Euler angles [rad]."""
    cr, sr = math.cos(0.5 * roll_rad), math.sin(0.5 * roll_rad)
    cp, sp = math.cos(0.5 * pitch_rad), math.sin(0.5 * pitch_rad)
    cy, sy = math.cos(0.5 * yaw_rad), math.sin(0.5 * yaw_rad)
    return np.array(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    )


def skew(vector: Array) -> Array:
    """Matrix (3, 3) with skew(a) @ b == cross(a, b)."""
    x, y, z = vector.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def swap_enu_ned(vector: Array) -> Array:
    """World vector (3,) from ENU to NED or back (the map is its own inverse)."""
    x, y, z = vector.tolist()
    return np.array((y, x, -z))


def swap_flu_frd(vector: Array) -> Array:
    """Body vector (3,) from FLU to FRD or back (the map is its own inverse)."""
    x, y, z = vector.tolist()
    return np.array((x, -y, -z))


def swap_quaternion_enu_ned(quaternion: Array) -> Array:
    """Attitude (4,) from FLU->ENU to FRD->NED or back (the map is its own inverse), with w >= 0.

    q_ned = q_enu_to_ned * q * q_frd_to_flu with q_enu_to_ned = (0, 1, 1, 0)/sqrt(2) and q_frd_to_flu = (0, 1, 0, 0).
    """
    w, x, y, z = quaternion.tolist()
    swapped = (_HALF_SQRT2 * (w + z), _HALF_SQRT2 * (x + y), _HALF_SQRT2 * (x - y), _HALF_SQRT2 * (w - z))
    return np.array(swapped) if swapped[0] >= 0.0 else -np.array(swapped)


def swap_yaw_enu_ned(yaw_rad: float) -> float:
    """Yaw angle from ENU (0 = east, counter-clockwise) to NED (0 = north, clockwise) or back, wrapped."""
    return wrap_angle(0.5 * math.pi - yaw_rad)
