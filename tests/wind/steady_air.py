"""Estimates of a vehicle that hovers or flies evenly in a steady wind, without the flight."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array, StateEstimate
from uasfly.wind.drag_curve import DragCurve

RATE_HZ = 50.0


def tilted(slope: tuple[float, float]) -> Array:
    """Quaternion whose body z axis points along (slope east, slope north, 1)."""
    size = math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
    x, y, z = slope[0] / size, slope[1] / size, 1.0 / size
    quaternion = np.array((1.0 + z, -y, x, 0.0))
    result: Array = quaternion / np.linalg.norm(quaternion)
    return result


def balancing_slope(air: tuple[float, float], curve: DragCurve) -> tuple[float, float]:
    """Slope of the thrust that balances the drag of air that moves so, horizontally, past the vehicle [m/s]."""
    speed = math.hypot(*air)
    slope = (0.0, 0.0)
    for _ in range(50):  # the drag depends on the thrust, which depends on the slope
        thrust = GRAVITY_M_S2 * math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
        ratio = curve.under_thrust(thrust).ratio(speed) / GRAVITY_M_S2
        slope = (-ratio * air[0], -ratio * air[1])
    return slope


def estimates(
    curve: DragCurve,
    wind: tuple[float, float],
    duration_s: float,
    *,
    velocity: tuple[float, float] = (0.0, 0.0),
    begin_s: float = 100.0,
    velocity_sigma_m_s: float = 0.02,
) -> Iterator[StateEstimate]:
    """Estimates without any error."""
    quaternion = tilted(balancing_slope((wind[0] - velocity[0], wind[1] - velocity[1]), curve))
    zero, moving = np.zeros(3), np.array((*velocity, 0.0))
    for k in range(round(duration_s * RATE_HZ)):
        yield StateEstimate(
            time_s=begin_s + k / RATE_HZ,
            position_in_world=zero,
            velocity_in_world=moving,
            quaternion_body_to_world=quaternion,
            angular_rate_in_body=zero,
            force_in_world=zero,
            gnss_bias_in_world=zero,
            position_sigma_m=zero,
            velocity_sigma_m_s=np.full(3, velocity_sigma_m_s),
            force_sigma_m_s2=zero,
        )
