"""Rate control: gyro filters and a PID with the derivative on the measurement, symbolically (CasADi).

As PX4: a Butterworth low-pass of second order on the gyro (IMU_GYRO_CUTOFF), a first-order one on its derivative
(IMU_DGYRO_CUTOFF), integrators that stop where the mixer saturates, a low-pass on the yaw torque (MC_YAW_TQ_CUTOFF).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

_LOWEST_HZ = 0.1


class RateGains(NamedTuple):
    """Gains of the three axes, each (3,): torque per rate, per angle, per acceleration; bound of the integral part."""

    proportional: ca.SX
    integral: ca.SX
    derivative: ca.SX
    integral_limit: ca.SX


def butterworth_coefficients(cutoff_hz: float, step_s: float) -> tuple[float, float, float]:
    """(b, a1, a2) of a Butterworth low-pass by the bilinear transform: y = b (u + 2 u1 + u2) - a1 y1 - a2 y2."""
    warped = math.tan(math.pi * min(max(cutoff_hz, _LOWEST_HZ), 0.45 / step_s) * step_s)
    scale = 1.0 / (1.0 + math.sqrt(2.0) * warped + warped * warped)
    return (
        warped * warped * scale,
        2.0 * (warped * warped - 1.0) * scale,
        (1.0 - math.sqrt(2.0) * warped + warped * warped) * scale,
    )


def low_pass_share(cutoff_hz: float, step_s: float) -> float:
    """Share of the new value in a first-order low-pass, exact for a held input."""
    return 1.0 - math.exp(-2.0 * math.pi * max(cutoff_hz, _LOWEST_HZ) * step_s)


def filter_gyro(memory: ca.SX, measured: ca.SX, coefficients: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Filtered rate (3,) and the memory (6,) for the next step (transposed direct form)."""
    b, a1, a2 = ca.vertsplit(coefficients)
    filtered = b * measured + memory[:3]
    return filtered, ca.vertcat(2.0 * b * measured - a1 * filtered + memory[3:], b * measured - a2 * filtered)


def rate_pid(error: ca.SX, acceleration: ca.SX, integral: ca.SX, gains: RateGains) -> ca.SX:
    """Normalised torque (3,) from the rate error [rad/s], the measured acceleration [rad/s^2] and the integral part."""
    return gains.proportional * error + integral - gains.derivative * acceleration


def next_integral(
    error: ca.SX, integral: ca.SX, saturation: ca.SX, gains: RateGains, enabled: ca.SX, step_s: float
) -> ca.SX:
    """Integral part (3,) a step later.

    Args:
        error: (3,) rate error [rad/s].
        integral: (3,) now.
        saturation: (3,) sign of the torque that the mixer could not give in the last step, 0 when it gave all.
        gains: see `RateGains`.
        enabled: 0 on the ground, where the integral rests, else 1.
        step_s: time step.
    """
    upwards, downwards = ca.fmax(error, 0.0), ca.fmin(error, 0.0)
    usable = upwards * (saturation <= 0.0) + downwards * (saturation >= 0.0)
    grown = integral + enabled * gains.integral * usable * step_s
    return ca.fmax(-gains.integral_limit, ca.fmin(gains.integral_limit, grown))
