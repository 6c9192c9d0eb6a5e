"""The paper's sensors, and the attitude that comes of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import (
    euler_from_quaternion,
    quaternion_from_euler,
    quaternion_from_rotation_vector,
    quaternion_inverse,
    quaternion_product,
    rotation_matrix,
    rotation_vector_from_quaternion,
    wrap_angle,
)
from uasfly.messages import Array

IMU_PERIOD_S = 0.02
HEADING_TIME_S = 2.0  # of the gyro's heading towards the magnetometer's
_GRAVITY = np.array((0.0, 0.0, GRAVITY_M_S2))


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Standard deviations, and biases that stay.

    Attributes:
        accelerometer_m_s2: of a sample. accelerometer_bias_m_s2: on each axis, its sign is drawn.
        gyro_rad_s, magnetometer_rad: of a sample. tilt_rad: of the ground from level, on each axis.
        gps_m: along x, y, z. barometer_m: of a height.
    """

    accelerometer_m_s2: float
    accelerometer_bias_m_s2: float = 0.1
    gyro_rad_s: float = math.radians(0.1)
    magnetometer_rad: float = math.radians(2.0)
    tilt_rad: float = math.radians(0.3)
    gps_m: tuple[float, float, float] = (0.05, 0.05, 0.10)
    barometer_m: float = 0.3


AS_LARGEST = SensorErrors(accelerometer_m_s2=0.1 * GRAVITY_M_S2)  # 0.3 g are three standard deviations
AS_SIGMA = SensorErrors(accelerometer_m_s2=0.3 * GRAVITY_M_S2)


class PaperSensors:
    """Readings of one flight: inertial ones at 50 Hz, positions at 10 Hz.

    Args:
        errors: see `SensorErrors`.
        rng: source of all of them.
        quaternion: (4,) true attitude at rest.
    """

    def __init__(self, errors: SensorErrors, rng: np.random.Generator, quaternion: Array) -> None:
        self._errors = errors
        self._rng = rng
        self.bias: Array = errors.accelerometer_bias_m_s2 * rng.choice((-1.0, 1.0), 3)
        tilt_x, tilt_y = errors.tilt_rad * rng.standard_normal(2)
        level = quaternion_from_rotation_vector(np.array((-tilt_x, -tilt_y, 0.0)))
        self._true = quaternion.copy()
        self._attitude = quaternion_product(level, quaternion)

    @property
    def quaternion(self) -> Array:
        """(4,) attitude, body to world, by gyro and magnetometer."""
        return self._attitude

    def turn(self, quaternion: Array) -> Array:
        """Follow the true attitude (4,) for a period; returns the gyro's mean rate (3,) [rad/s, body] in it."""
        errors, rng = self._errors, self._rng
        turned = rotation_vector_from_quaternion(quaternion_product(quaternion_inverse(self._true), quaternion))
        rate = turned / IMU_PERIOD_S + errors.gyro_rad_s * rng.standard_normal(3)
        self._true = quaternion.copy()
        step = quaternion_from_rotation_vector(rate * IMU_PERIOD_S)
        attitude = quaternion_product(self._attitude, step)
        compass = euler_from_quaternion(quaternion)[2] + errors.magnetometer_rad * rng.standard_normal()
        behind = wrap_angle(float(compass) - euler_from_quaternion(attitude)[2])
        towards = quaternion_from_euler(0.0, 0.0, behind * IMU_PERIOD_S / HEADING_TIME_S)
        attitude = quaternion_product(towards, attitude)
        self._attitude = attitude / np.linalg.norm(attitude)
        return np.asarray(rate)

    def specific_force(self, acceleration: Array, quaternion: Array) -> Array:
        """Accelerometer (3,) [m/s^2] of a true acceleration (3,) in the world."""
        true = rotation_matrix(quaternion).T @ (acceleration + _GRAVITY)
        noise = self._errors.accelerometer_m_s2 * self._rng.standard_normal(3)
        return np.asarray(true + self.bias + noise)

    def gps(self, position: Array) -> Array:
        """Position (3,) [m]."""
        return np.asarray(position + np.array(self._errors.gps_m) * self._rng.standard_normal(3))

    def barometer(self, height_m: float) -> float:
        """Height [m]."""
        return height_m + self._errors.barometer_m * float(self._rng.standard_normal())
