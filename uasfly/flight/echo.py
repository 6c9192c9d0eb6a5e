"""What PX4 is being told anyway, as a setpoint: streamed back until the hand-over, so that the switch is no bump."""

from __future__ import annotations

import math
from dataclasses import replace

from uasfly.airframe import Limits
from uasfly.flight.view import VehicleView
from uasfly.frames import euler_from_quaternion
from uasfly.messages import Setpoint

TARGET_FRESH_S = 0.5  # an older attitude target is not what the vehicle is being told


def told(view: VehicleView, time_s: float) -> Setpoint | None:
    """What PX4's attitude controller is being asked for, None where that is not known freshly."""
    target = view.attitude_target
    if target is None or abs(time_s - target.time_s) > TARGET_FRESH_S:
        return None
    roll, pitch, yaw = euler_from_quaternion(target.quaternion_body_to_world)
    if not math.isfinite(roll + pitch + yaw + target.thrust):
        return None
    return Setpoint(target.time_s, roll, pitch, yaw, 0.0, target.thrust)


def echo(view: VehicleView, time_s: float, limits: Limits) -> Setpoint | None:
    """The same within the airframe's limits, for now."""
    target = told(view, time_s)
    if target is None:
        return None
    return replace(
        target,
        time_s=time_s,
        roll_rad=min(max(target.roll_rad, -limits.tilt_rad), limits.tilt_rad),
        pitch_rad=min(max(target.pitch_rad, -limits.tilt_rad), limits.tilt_rad),
        thrust=min(max(target.thrust, limits.thrust_min), limits.thrust_max),
    )
