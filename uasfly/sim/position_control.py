"""Position control as PX4 does it: position P, velocity PID, acceleration to thrust and attitude, in plain floats.

World ENU. The vertical is served first; of what thrust is left, the horizontal keeps MPC_THR_XY_MARG.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.sim.body import GRAVITY_M_S2
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.rate_control import low_pass_share

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_SMALLEST_THRUST = 1e-3
_LARGEST_INTEGRAL = 100.0  # m/s^2, far beyond every tilt: a senseless gain must not carry it to infinity


@dataclass(slots=True)
class MotionSetpoint:
    """What a mode wants of the position controller.

    Attributes:
        position: (3,) [m], world. velocity: (3,) [m/s] feed-forward. yaw_rad: heading.
        track_horizontal: False: stay level, without a horizontal position.
        track_height: False: only the vertical velocity counts.
        climb_limit_m_s: largest upward velocity; negative while a take-off ramps thrust up.
        idle: True: no thrust, the vehicle stands on the ground.
    """

    position: Vector
    velocity: Vector
    yaw_rad: float
    track_horizontal: bool = True
    track_height: bool = True
    climb_limit_m_s: float = math.inf
    idle: bool = False


@dataclass(slots=True)
class AttitudeSetpoint:
    """What the inner loop takes: attitude body to world, thrust 0..1, yaw rate as feed-forward [rad/s]."""

    attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
    thrust: float = 0.0
    yaw_rate_rad_s: float = 0.0


class HoverThrust:
    """Thrust command that carries the weight, learned in flight (a first-order filter in the place of PX4's)."""

    _TIME_CONSTANT_S = 2.0

    def __init__(self, initial: float) -> None:
        self.value = initial

    def learn(self, thrust: float, tilt_cosine: float, upward_m_s2: float, duration_s: float) -> None:
        """Compare commanded thrust with what it does: thrust * cos(tilt) / hover = (a_z + g) / g."""
        specific_force = upward_m_s2 + GRAVITY_M_S2
        if specific_force < 0.5 * GRAVITY_M_S2 or thrust < 0.05:
            return
        seen = min(0.9, max(0.1, thrust * tilt_cosine * GRAVITY_M_S2 / specific_force))
        self.value += (seen - self.value) * min(1.0, duration_s / self._TIME_CONSTANT_S)


class PositionControl:
    """The cascade and its memory."""

    def __init__(self, parameters: ParameterTable, duration_s: float) -> None:
        self._duration_s = duration_s
        self._parameters = parameters
        self.read_parameters()
        self.reset()

    def read_parameters(self) -> None:
        """Take gains and limits over from the parameter table."""
        value = self._parameters.value
        self._position_gain = (value("MPC_XY_P"), value("MPC_Z_P"))
        self._horizontal = tuple(value(f"MPC_XY_VEL_{term}_ACC") for term in "PID")
        self._vertical = tuple(value(f"MPC_Z_VEL_{term}_ACC") for term in "PID")
        self._speed_limit = max(0.0, value("MPC_XY_VEL_MAX"))
        self._climb_limit, self._sink_limit = value("MPC_Z_VEL_MAX_UP"), value("MPC_Z_VEL_MAX_DN")
        self._thrust_range = (value("MPC_THR_MIN"), max(value("MPC_THR_MAX"), 0.1))
        self._margin = value("MPC_THR_XY_MARG")
        self._derivative_share = low_pass_share(value("MPC_VELD_LP"), self._duration_s)

    def reset(self) -> None:
        """Forget integrals, the last velocity and the hover thrust that the integrals belong to."""
        self._integral = [0.0, 0.0, 0.0]
        self._hover_thrust: float | None = None
        self._last_acceleration_z = 0.0
        self._last_velocity: Vector | None = None
        self._derivative = [0.0, 0.0, 0.0]

    def update(
        self, setpoint: MotionSetpoint, position: Vector, velocity: Vector, hover_thrust: float, tilt_limit_rad: float
    ) -> AttitudeSetpoint:
        """One cycle.

        Args:
            setpoint: what to do.
            position: the estimate [m], world.
            velocity: the estimate [m/s], world.
            hover_thrust: thrust command 0..1 that carries the weight.
            tilt_limit_rad: largest tilt.
        """
        if setpoint.idle:
            self.reset()
            return AttitudeSetpoint(_attitude(0.0, 0.0, 1.0, setpoint.yaw_rad), 0.0)
        self._differentiate(velocity)
        self._absorb(hover_thrust)
        error_x, error_y, error_z = self._velocity_error(setpoint, position, velocity)
        acceleration_x, acceleration_y = self._horizontal_acceleration(setpoint, error_x, error_y)
        acceleration_z = self._vertical[0] * error_z + self._integral[2] - self._vertical[2] * self._derivative[2]
        self._last_acceleration_z = acceleration_z

        low, high = self._thrust_range
        if setpoint.climb_limit_m_s < math.inf:
            low = 0.0  # PX4 takes the lower limit for flight only
        flat = math.hypot(acceleration_x, acceleration_y)
        slope = min(flat / GRAVITY_M_S2, math.tan(tilt_limit_rad))
        lift = max(_SMALLEST_THRUST, hover_thrust * (1.0 + acceleration_z / GRAVITY_M_S2))
        wanted_side = lift * slope
        kept_side = min(wanted_side, self._margin)
        lift_limit = math.sqrt(max(0.0, high * high - kept_side * kept_side))
        if not ((lift >= lift_limit and error_z > 0.0) or (lift <= low and error_z < 0.0)):
            self._integral[2] += self._vertical[1] * error_z * self._duration_s
            self._integral[2] = min(GRAVITY_M_S2, max(-GRAVITY_M_S2, self._integral[2]))
        lift = max(_SMALLEST_THRUST, min(lift, lift_limit))
        side = min(lift * slope, math.sqrt(max(0.0, high * high - lift * lift)))
        reached = side / lift * GRAVITY_M_S2
        if setpoint.track_horizontal:
            self._integrate_horizontal(error_x, error_y, acceleration_x, acceleration_y, reached, flat)
        share = side / flat if flat > 1e-9 else 0.0
        thrust = max(math.hypot(side, lift), low)
        attitude = _attitude(share * acceleration_x, share * acceleration_y, lift, setpoint.yaw_rad)
        return AttitudeSetpoint(attitude, min(thrust, high))

    def _absorb(self, hover_thrust: float) -> None:
        """Let the integral take over what a new hover thrust would change, so that the thrust goes on as it was.

        As PX4's PositionControl::updateHoverThrust: T = hover (1 + a / g) is the same before and after.
        """
        hover_thrust = max(hover_thrust, _SMALLEST_THRUST)  # MPC_THR_HOVER may be anything
        if self._hover_thrust is not None:
            specific_force = self._last_acceleration_z + GRAVITY_M_S2
            value = self._integral[2] + specific_force * (self._hover_thrust / hover_thrust - 1.0)
            self._integral[2] = min(_LARGEST_INTEGRAL, max(-_LARGEST_INTEGRAL, value))
        self._hover_thrust = hover_thrust

    def _velocity_error(self, setpoint: MotionSetpoint, position: Vector, velocity: Vector) -> Vector:
        gain, vertical_gain = self._position_gain
        wanted_x = setpoint.velocity[0] + gain * (setpoint.position[0] - position[0])
        wanted_y = setpoint.velocity[1] + gain * (setpoint.position[1] - position[1])
        speed = math.hypot(wanted_x, wanted_y)
        if speed > self._speed_limit:
            wanted_x, wanted_y = wanted_x * self._speed_limit / speed, wanted_y * self._speed_limit / speed
        wanted_z = setpoint.velocity[2]
        if setpoint.track_height:
            wanted_z += vertical_gain * (setpoint.position[2] - position[2])
        wanted_z = min(max(-self._sink_limit, wanted_z), self._climb_limit, setpoint.climb_limit_m_s)
        return wanted_x - velocity[0], wanted_y - velocity[1], wanted_z - velocity[2]

    def _horizontal_acceleration(self, setpoint: MotionSetpoint, error_x: float, error_y: float) -> tuple[float, float]:
        if not setpoint.track_horizontal:
            self._integral[0] = self._integral[1] = 0.0
            return 0.0, 0.0
        proportional, _, derivative = self._horizontal
        return (
            proportional * error_x + self._integral[0] - derivative * self._derivative[0],
            proportional * error_y + self._integral[1] - derivative * self._derivative[1],
        )

    def _integrate_horizontal(
        self, error_x: float, error_y: float, wanted_x: float, wanted_y: float, reached: float, flat: float
    ) -> None:
        """Integrate, and while tilt or thrust is at its limit pull the integral back (Rundqwist 1990)."""
        proportional, integral, _ = self._horizontal
        if flat > reached + 1e-9 and proportional > 0.0:
            excess = 2.0 / proportional * (1.0 - reached / flat)
            error_x -= excess * wanted_x
            error_y -= excess * wanted_y
        for axis, error in enumerate((error_x, error_y)):
            value = self._integral[axis] + integral * error * self._duration_s
            self._integral[axis] = min(_LARGEST_INTEGRAL, max(-_LARGEST_INTEGRAL, value))

    def _differentiate(self, velocity: Vector) -> None:
        if self._last_velocity is not None:
            share = self._derivative_share
            for axis in range(3):
                raw = (velocity[axis] - self._last_velocity[axis]) / self._duration_s
                self._derivative[axis] += share * (raw - self._derivative[axis])
        self._last_velocity = velocity


def _attitude(x: float, y: float, z: float, yaw_rad: float) -> Quaternion:
    """Attitude whose body z axis points along (x, y, z) in the world, with the heading `yaw_rad`."""
    length = math.sqrt(x * x + y * y + z * z)
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    forward, left, up = (cosine * x + sine * y) / length, (cosine * y - sine * x) / length, z / length
    half_roll = 0.5 * math.asin(max(-1.0, min(1.0, -left)))
    half_pitch, half_yaw = 0.5 * math.atan2(forward, up), 0.5 * yaw_rad
    cr, sr = math.cos(half_roll), math.sin(half_roll)
    cp, sp = math.cos(half_pitch), math.sin(half_pitch)
    cy, sy = math.cos(half_yaw), math.sin(half_yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
