"""A point that moves to a target within speed and acceleration limits: the path that the automatic modes follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector = tuple[float, float, float]

_APPROACH_1_S = 0.5  # how fast the last bit of the way is closed (PX4: MPC_XY_TRAJ_P)


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Speeds [m/s] and accelerations [m/s^2] of the moving point."""

    speed_m_s: float
    climb_m_s: float
    sink_m_s: float
    acceleration_m_s2: float
    vertical_acceleration_m_s2: float


class Approach:
    """The moving point.

    Attributes:
        position: (x, y, z) [m], world. velocity: [m/s].
    """

    def __init__(self, position: Vector, velocity: Vector) -> None:
        self.position = position
        self.velocity = velocity

    def advance(self, target: Vector, limits: MotionLimits, duration_s: float) -> None:
        """Move on towards the target [m]."""
        x, y, z = self.position
        vx, vy, vz = self.velocity
        to_x, to_y, to_z = target[0] - x, target[1] - y, target[2] - z
        distance = math.hypot(to_x, to_y)
        speed = min(limits.speed_m_s, _closing_speed(distance, limits.acceleration_m_s2))
        share = speed / distance if distance > 1e-9 else 0.0
        change_x, change_y = share * to_x - vx, share * to_y - vy
        change = math.hypot(change_x, change_y)
        if change > limits.acceleration_m_s2 * duration_s:
            scale = limits.acceleration_m_s2 * duration_s / change
            change_x, change_y = change_x * scale, change_y * scale
        vertical = math.copysign(_closing_speed(abs(to_z), limits.vertical_acceleration_m_s2), to_z)
        vertical = max(-limits.sink_m_s, min(limits.climb_m_s, vertical))
        step = limits.vertical_acceleration_m_s2 * duration_s
        change_z = max(-step, min(step, vertical - vz))
        self.velocity = (vx + change_x, vy + change_y, vz + change_z)
        self.position = (
            x + (vx + 0.5 * change_x) * duration_s,
            y + (vy + 0.5 * change_y) * duration_s,
            z + (vz + 0.5 * change_z) * duration_s,
        )


def braking_point(position: Vector, velocity: Vector, limits: MotionLimits) -> Vector:
    """Where a vehicle comes to rest that brakes at once."""
    reach = math.hypot(velocity[0], velocity[1]) / (2.0 * limits.acceleration_m_s2)
    rise = abs(velocity[2]) / (2.0 * limits.vertical_acceleration_m_s2)
    return (
        position[0] + reach * velocity[0],
        position[1] + reach * velocity[1],
        position[2] + rise * velocity[2],
    )


def _closing_speed(distance: float, acceleration: float) -> float:
    """Speed at which a point may be this far from its target: sqrt(a d) far away, braking at half of a; P near it."""
    knee = acceleration / (2.0 * _APPROACH_1_S)
    return math.sqrt(knee * knee + acceleration * distance) - knee
