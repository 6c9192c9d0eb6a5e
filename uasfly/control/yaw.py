"""Yaw: a PID to a yaw rate (Kalaitzakis 2023, section 3), and the yaw setpoint that goes with it.

What PX4 makes of a setpoint (REFERENCE of the project, section 3): with type mask 3 its attitude controller turns the
error between its attitude and the yaw setpoint into a yaw rate, P = MC_YAW_P, 2.8 1/s by default, and adds the yaw rate
that we send. If the yaw setpoint were the reference and the yaw rate the PID's, the same error would act twice, through
PX4's gain and through ours, and PX4 would turn at its own limit (200 deg/s) where the reference is far away.

So the two are made one motion: the PID's rate, limited, is what we send as feed-forward, and the yaw setpoint is the
integral of that rate, from the yaw at the start (the paper's yaw' = yaw_rate_d). PX4 sees a setpoint and its derivative
and corrects only how its vehicle follows them; the PID alone sees the reference and corrects the rest. The setpoint
being an integral, an offset between PX4's heading and ours vanishes with a proportional gain alone.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import Pid
from uasfly.frames import wrap_angle
from uasfly.messages import Array

LEASH_RAD = math.radians(25.0)  # the setpoint waits for a vehicle that does not follow
DERIVATIVE_FILTER_S = 0.1
LONGEST_STEP_S = 0.2


class YawController:
    """PID on the wrapped yaw error with the reference's yaw rate as feed-forward."""

    def __init__(self, pid: Pid, rate_limit_rad_s: float) -> None:
        self._pid = pid
        self._limit = rate_limit_rad_s
        self.reset(None)

    def reset(self, yaw_rad: float | None) -> None:
        """Start from a yaw setpoint [rad], or from the measured yaw of the first step."""
        self.setpoint_rad = yaw_rad
        self._integral = 0.0
        self._derivative: float | None = None
        self._time_s: float | None = None

    def step(
        self,
        time_s: float,
        yaw_rad: float,
        yaw_rate_rad_s: float,
        reference_rad: float,
        reference_rate_rad_s: float,
    ) -> tuple[float, float]:
        """Yaw setpoint [rad, wrapped] and yaw rate [rad/s] from the yaw and its rate and their reference.

        Where yaw or its rate is not finite the rate is the reference's; where that is not finite either, zero.
        """
        elapsed = 0.0 if self._time_s is None else min(max(time_s - self._time_s, 0.0), LONGEST_STEP_S)
        self._time_s = time_s
        forward = reference_rate_rad_s if math.isfinite(reference_rate_rad_s) else 0.0
        known = math.isfinite(yaw_rad + yaw_rate_rad_s + reference_rad)
        correction = 0.0
        if known:
            error = wrap_angle(reference_rad - yaw_rad)
            correction = self._correction(error, forward - yaw_rate_rad_s, forward, elapsed)
        rate = min(max(forward + correction, -self._limit), self._limit)
        if self.setpoint_rad is None:
            self.setpoint_rad = yaw_rad if math.isfinite(yaw_rad) else 0.0
        setpoint = self.setpoint_rad + elapsed * rate
        if known:
            ahead = wrap_angle(setpoint - yaw_rad)
            setpoint = yaw_rad + min(max(ahead, -LEASH_RAD), LEASH_RAD)
        self.setpoint_rad = wrap_angle(setpoint)
        return self.setpoint_rad, rate

    def _correction(self, error: float, error_rate: float, forward: float, elapsed: float) -> float:
        pid = self._pid
        if self._derivative is None:
            self._derivative = error_rate
        self._derivative += (1.0 - math.exp(-elapsed / DERIVATIVE_FILTER_S)) * (error_rate - self._derivative)
        correction = pid.kp * error + self._integral + pid.kd * self._derivative
        saturated = abs(forward + correction) > self._limit and (forward + correction) * error > 0.0
        if not saturated:
            self._integral += pid.ki * error * elapsed
            self._integral = min(max(self._integral, -pid.integral_limit), pid.integral_limit)
        return correction

    def remaining_error(self, error_rad: float, times_s: Array) -> Array:
        """How the yaw error (n,) [rad] will decay from `error_rad` now, at times (n,) [s]: what the horizon assumes.

        With the rate correction kp * error + kd * error' the error falls like exp(-kp / (1 + kd) t), or at the limit
        of the yaw rate while that is slower.
        """
        decay = max(self._pid.kp / (1.0 + self._pid.kd), 1e-3)
        free = self._limit / decay  # from here on the limit no longer matters
        size = abs(error_rad)
        if size <= free:
            return np.asarray(error_rad * np.exp(-decay * times_s))
        turning = (size - free) / self._limit
        after = free * np.exp(-decay * np.maximum(times_s - turning, 0.0))
        return np.asarray(
            math.copysign(1.0, error_rad) * np.where(times_s < turning, size - self._limit * times_s, after)
        )
