"""What both controllers share: the vehicle's state taken apart, the yaw setpoint and the last check of a setpoint."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.airframe import Limits
from uasfly.frames import euler_from_quaternion, wrap_angle
from uasfly.messages import Array, Setpoint, StateEstimate


@dataclass(slots=True)
class Attitude:
    """Roll, pitch, yaw [rad] and the rate of yaw [rad/s] of an estimate."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    yaw_rate_rad_s: float

    @classmethod
    def of(cls, estimate: StateEstimate) -> Attitude:
        """From quaternion and body rates; not finite where those are not."""
        if not math.isfinite(sum(estimate.quaternion_body_to_world.tolist())):
            return cls(math.nan, math.nan, math.nan, math.nan)
        roll, pitch, yaw = euler_from_quaternion(estimate.quaternion_body_to_world)
        _, rate_y, rate_z = estimate.angular_rate_in_body.tolist()
        level = max(math.cos(pitch), 0.2)
        return cls(roll, pitch, yaw, (math.sin(roll) * rate_y + math.cos(roll) * rate_z) / level)


def all_finite(*arrays: Array) -> bool:
    """Whether every entry of small arrays is finite."""
    return all(math.isfinite(sum(array.tolist())) for array in arrays)


class SetpointGuard:
    """The last thing before a setpoint leaves: inside the limits, and finite whatever happened before."""

    def __init__(self, limits: Limits, hover_thrust: float) -> None:
        self._limits = limits
        self._tilt_rad, self._yaw_rate_rad_s = limits.tilt_rad, limits.yaw_rate_rad_s
        self._hover_thrust = hover_thrust
        self._yaw_rad = 0.0

    def setpoint(self, time_s: float, inputs: Array, yaw_rad: float, yaw_rate_rad_s: float) -> Setpoint:
        """Setpoint from inputs (3,) [thrust, roll_d, pitch_d], yaw and yaw rate.

        What is not finite becomes level, hover thrust, the last yaw and no yaw rate.
        """
        limits = self._limits
        thrust, roll, pitch = inputs.tolist()
        if math.isfinite(yaw_rad):
            self._yaw_rad = wrap_angle(yaw_rad)
        return Setpoint(
            time_s=time_s,
            roll_rad=_bounded(roll, 0.0, -self._tilt_rad, self._tilt_rad),
            pitch_rad=_bounded(pitch, 0.0, -self._tilt_rad, self._tilt_rad),
            yaw_rad=self._yaw_rad,
            yaw_rate_rad_s=_bounded(yaw_rate_rad_s, 0.0, -self._yaw_rate_rad_s, self._yaw_rate_rad_s),
            thrust=_bounded(thrust, self._hover_thrust, limits.thrust_min, limits.thrust_max),
        )


def _bounded(value: float, otherwise: float, lower: float, upper: float) -> float:
    return min(max(value if math.isfinite(value) else otherwise, lower), upper)
