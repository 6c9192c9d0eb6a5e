"""The backup PIDs of the paper, and the baseline `--controller pid`: position error to acceleration to tilt and thrust.

Kalaitzakis 2023, section 3. The derivative acts on the velocity error, the reference acceleration is fed forward, and
eq. 1 is inverted for tilt and thrust. A PID knows no wind force: its integral has to find it.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from uasfly.airframe import Backup, Limits, ModelParameters
from uasfly.control.buffered import BufferedFunction
from uasfly.messages import Array
from uasfly.model import (
    PARAMETER_DRAG,
    PARAMETER_FORCE,
    PARAMETER_K_THRUST,
    PARAMETERS,
    acceleration_in_world,
    controller_parameters,
    thrust_direction_from_tilt,
    trim_from_acceleration,
)

LONGEST_STEP_S = 0.2
SATURATED_M_S2 = 1e-6


class PositionPid:
    """Position PID for three axes; its output is what the controller's model calls inputs."""

    def __init__(self, gains: Backup, model: ModelParameters, limits: Limits) -> None:
        axes = (gains.horizontal, gains.horizontal, gains.vertical)
        self._kp = np.array([axis.kp for axis in axes])
        self._ki = np.array([axis.ki for axis in axes])
        self._kd = np.array([axis.kd for axis in axes])
        self._integral_limit = np.array([axis.integral_limit for axis in axes])
        self._commands_from_angles = np.array((1.0 / model.roll.gain, 1.0 / model.pitch.gain))
        self._trim, self._flown = BufferedFunction(_trim_function()), BufferedFunction(_acceleration_function())
        self._trim.arguments[2][:] = controller_parameters(model, np.zeros(3), model.k_thrust_m_s2)
        self._trim.arguments[4][:] = limits.tilt_rad, limits.thrust_min, limits.thrust_max
        self._model = model
        self.integral = np.zeros(3)

    def reset(self, integral_m_s2: Array | None = None) -> None:
        """Start with an integral (3,) [m/s^2, world], zero without; it is clipped to its limits."""
        integral = np.zeros(3) if integral_m_s2 is None else np.nan_to_num(integral_m_s2, posinf=0.0, neginf=0.0)
        self.integral = np.clip(integral, -self._integral_limit, self._integral_limit)

    def proportional(self, position_error: Array, velocity_error: Array, acceleration: Array) -> Array:
        """Wanted acceleration (3,) [m/s^2] without the integral; an error that is not finite counts as zero."""
        errors = np.concatenate((position_error, velocity_error, acceleration))
        known = np.where(np.isfinite(errors), errors, 0.0)
        return np.asarray(known[6:] + self._kp * known[:3] + self._kd * known[3:6])

    def step(
        self,
        elapsed_s: float,
        position_error: Array,
        velocity_error: Array,
        velocity: Array,
        acceleration: Array,
        yaw_rad: float,
        k_thrust_m_s2: float,
    ) -> Array:
        """Inputs (3,) [thrust, roll_d, pitch_d], inside the limits.

        Args:
            elapsed_s: since the last step; at most 0.2 s are integrated.
            position_error: (3,) reference minus vehicle, in the world [m].
            velocity_error: (3,) likewise [m/s].
            velocity: (3,) of the vehicle [m/s].
            acceleration: (3,) of the reference [m/s^2].
            yaw_rad: of the vehicle.
            k_thrust_m_s2: at the present battery voltage.
        """
        wanted = self.proportional(position_error, velocity_error, acceleration) + self.integral
        trim = self._trim
        trim.arguments[0][:], trim.arguments[1][:] = wanted, np.where(np.isfinite(velocity), velocity, 0.0)
        trim.arguments[2][PARAMETER_K_THRUST], trim.arguments[3][0] = k_thrust_m_s2, yaw_rad
        trim.call()
        angles_and_thrust, flown = trim.results
        self._integrate(min(max(elapsed_s, 0.0), LONGEST_STEP_S), position_error, wanted - flown)
        inputs = np.empty(3)
        inputs[0] = angles_and_thrust[2]
        inputs[1:] = angles_and_thrust[:2] * self._commands_from_angles
        return inputs

    def _integrate(self, elapsed_s: float, position_error: Array, unflown: Array) -> None:
        """Anti-windup: an axis whose wish the limits cut does not integrate further that way."""
        error = np.where(np.isfinite(position_error), position_error, 0.0)
        blocked = (np.abs(unflown) > SATURATED_M_S2) & (unflown * error > 0.0)
        change = np.where(blocked, 0.0, self._ki * error * elapsed_s)
        self.integral = np.clip(self.integral + change, -self._integral_limit, self._integral_limit)

    def acceleration_of(self, inputs: tuple[float, float, float], velocity: Array, yaw_rad: float) -> Array:
        """Acceleration (3,) [m/s^2] that inputs give in still air, attitude settled, at the last k_thrust."""
        thrust, roll, pitch = inputs
        model, flown = self._model, self._flown
        flown.arguments[0][:] = model.roll.gain * roll, model.pitch.gain * pitch, thrust
        flown.arguments[1][:], flown.arguments[2][:] = velocity, self._trim.arguments[2]
        flown.arguments[3][0] = yaw_rad
        flown.call()
        return flown.results[0].copy()


def _flown(trim: ca.SX, velocity: ca.SX, parameters: ca.SX, yaw: ca.SX) -> ca.SX:
    direction = thrust_direction_from_tilt(trim[0], trim[1], yaw)
    thrust = parameters[PARAMETER_K_THRUST] * trim[2]
    return acceleration_in_world(velocity, direction, thrust, parameters[PARAMETER_FORCE], parameters[PARAMETER_DRAG])


def _acceleration_function() -> ca.Function:
    """Acceleration (3,) by eq. 1 from [roll, pitch, thrust], velocity (3,), parameters (11,) and yaw."""
    trim, velocity = ca.SX.sym("trim", 3), ca.SX.sym("v", 3)
    parameters, yaw = ca.SX.sym("p", PARAMETERS), ca.SX.sym("yaw")
    return ca.Function("pid_acceleration", [trim, velocity, parameters, yaw], [_flown(trim, velocity, parameters, yaw)])


def _trim_function() -> ca.Function:
    """[roll, pitch, thrust] for an acceleration (3,) at a velocity (3,), and the acceleration they really give."""
    acceleration, velocity = ca.SX.sym("a", 3), ca.SX.sym("v", 3)
    parameters, yaw, limits = ca.SX.sym("p", PARAMETERS), ca.SX.sym("yaw"), ca.SX.sym("limits", 3)
    trim = trim_from_acceleration(acceleration, velocity, parameters, yaw, limits)
    flown = _flown(trim, velocity, parameters, yaw)
    return ca.Function("pid_trim", [acceleration, velocity, parameters, yaw, limits], [trim, flown], {"cse": True})
