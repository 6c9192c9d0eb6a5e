"""The multirotor model of Kalaitzakis & Vitzilaios 2023 (eq. 1 and 2), written once, symbolically.

Controller, observer and identification take their dynamics and Jacobians from here.
World frame ENU, body frame FLU, forces are mass-normalised [m/s^2].
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from uasfly.airframe import GRAVITY_M_S2, ModelParameters
from uasfly.messages import Array

# State of the controller's model: yaw is known from the yaw rate, so it is a parameter.
POSITION = slice(0, 3)  # m, world
VELOCITY = slice(3, 6)  # m/s, world
ROLL = 6  # rad
PITCH = 7  # rad
STATES = 8

# Inputs of the controller's model.
THRUST = 0  # 0..1
ROLL_COMMAND = 1  # rad
PITCH_COMMAND = 2  # rad
INPUTS = 3

# Parameters of the controller's model.
PARAMETER_TAU_ROLL, PARAMETER_GAIN_ROLL, PARAMETER_TAU_PITCH, PARAMETER_GAIN_PITCH = range(4)  # s, 1, s, 1
PARAMETER_DRAG = slice(4, 7)  # 1/s, positive
PARAMETER_FORCE = slice(7, 10)  # m/s^2, world
PARAMETER_K_THRUST = 10  # m/s^2
PARAMETERS = 11

# How `trim_from_acceleration` shares a limited thrust.
VERTICAL_SHARE = 0.95  # of the largest thrust may go into lift; what is left still tilts 18 degrees
LEAST_LIFT_M_S2 = 0.5  # keeps the angles defined when a reference asks for free fall


def thrust_direction_from_tilt(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Body z axis in the world (3,) for Z-Y-X Euler angles [rad]."""
    cr, sr, cp, sp, cy, sy = ca.cos(roll), ca.sin(roll), ca.cos(pitch), ca.sin(pitch), ca.cos(yaw), ca.sin(yaw)
    return ca.vertcat(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)


def rotation_from_quaternion(quaternion: ca.SX) -> ca.SX:
    """Rotation matrix (3, 3), body to world, of a unit Hamilton quaternion (4,), w first."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def quaternion_product(left: ca.SX, right: ca.SX) -> ca.SX:
    """Hamilton product (4,) of two quaternions (4,)."""
    w1, x1, y1, z1 = left[0], left[1], left[2], left[3]
    w2, x2, y2, z2 = right[0], right[1], right[2], right[3]
    return ca.vertcat(
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
    )


def acceleration_in_world(
    velocity: ca.SX, thrust_direction: ca.SX, thrust_acceleration: ca.SX, force: ca.SX, drag: ca.SX
) -> ca.SX:
    """Acceleration (3,) [m/s^2] of eq. 1: v' = -diag(drag) v + R [0, 0, T] - [0, 0, g] + F."""
    gravity = ca.DM([0.0, 0.0, GRAVITY_M_S2])
    return -drag * velocity + thrust_direction * thrust_acceleration - gravity + force


def body_dynamics(
    velocity: ca.SX,
    quaternion: ca.SX,
    angular_rate: ca.SX,
    thrust_acceleration: ca.SX,
    force: ca.SX,
    drag: ca.SX,
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Time derivatives of position (3,), velocity (3,) and quaternion (4,) with the attitude as a quaternion (eq. 1).

    Args:
        velocity: (3,) m/s, world.
        quaternion: (4,) body to world.
        angular_rate: (3,) rad/s, body.
        thrust_acceleration: m/s^2 along the body z axis.
        force: (3,) m/s^2, world, mass-normalised.
        drag: (3,) 1/s, positive.
    """
    direction = rotation_from_quaternion(quaternion)[:, 2]
    acceleration = acceleration_in_world(velocity, direction, thrust_acceleration, force, drag)
    return velocity, acceleration, 0.5 * quaternion_product(quaternion, ca.vertcat(0, angular_rate))


def controller_dynamics(state: ca.SX, inputs: ca.SX, parameters: ca.SX, yaw: ca.SX) -> ca.SX:
    """Time derivative (8,) of [p, v, roll, pitch] under [thrust, roll_d, pitch_d] (eq. 1 and 2)."""
    direction = thrust_direction_from_tilt(state[ROLL], state[PITCH], yaw)
    acceleration = acceleration_in_world(
        state[VELOCITY],
        direction,
        parameters[PARAMETER_K_THRUST] * inputs[THRUST],
        parameters[PARAMETER_FORCE],
        parameters[PARAMETER_DRAG],
    )
    gain_roll, gain_pitch = parameters[PARAMETER_GAIN_ROLL], parameters[PARAMETER_GAIN_PITCH]
    roll_rate = (gain_roll * inputs[ROLL_COMMAND] - state[ROLL]) / parameters[PARAMETER_TAU_ROLL]
    pitch_rate = (gain_pitch * inputs[PITCH_COMMAND] - state[PITCH]) / parameters[PARAMETER_TAU_PITCH]
    return ca.vertcat(state[VELOCITY], acceleration, roll_rate, pitch_rate)


def controller_parameters(model: ModelParameters, force_in_world: Array, k_thrust_m_s2: float) -> Array:
    """Parameter vector (11,) of `controller_dynamics` for a model, a force and the present k_thrust, both [m/s^2]."""
    return np.array(
        (
            model.roll.tau_s,
            model.roll.gain,
            model.pitch.tau_s,
            model.pitch.gain,
            *model.drag_1_s,
            *force_in_world.tolist(),
            k_thrust_m_s2,
        )
    )


def attitude_response(state: ca.SX, inputs: ca.SX, parameters: ca.SX, time: ca.SX) -> ca.SX:
    """Roll and pitch (2,) [rad] after `time` [s] of constant commands: the exact solution of eq. 2."""
    settled_roll = parameters[PARAMETER_GAIN_ROLL] * inputs[ROLL_COMMAND]
    settled_pitch = parameters[PARAMETER_GAIN_PITCH] * inputs[PITCH_COMMAND]
    decay_roll = ca.exp(-time / parameters[PARAMETER_TAU_ROLL])
    decay_pitch = ca.exp(-time / parameters[PARAMETER_TAU_PITCH])
    return ca.vertcat(
        settled_roll + (state[ROLL] - settled_roll) * decay_roll,
        settled_pitch + (state[PITCH] - settled_pitch) * decay_pitch,
    )


def trim_from_acceleration(acceleration: ca.SX, velocity: ca.SX, parameters: ca.SX, yaw: ca.SX, limits: ca.SX) -> ca.SX:
    """Roll, pitch [rad] and thrust command (3,) under which eq. 1 gives `acceleration` at `velocity`: its inverse.

    Where the limits are in the way, height comes first: the vertical part of the thrust may use up to
    `VERTICAL_SHARE` of the largest thrust, the horizontal part is shortened to what is left, then the angles are
    clipped and the thrust makes up for the lost tilt.

    Args:
        acceleration: (3,) in the world [m/s^2].
        velocity: (3,) in the world [m/s].
        parameters: (11,) as in `controller_dynamics`; the force is compensated.
        yaw: [rad].
        limits: (3,) largest roll and pitch command [rad], least and largest thrust command.
    """
    k_thrust, tilt = parameters[PARAMETER_K_THRUST], limits[0]
    least, largest = k_thrust * limits[1], k_thrust * limits[2]
    gravity = ca.DM([0.0, 0.0, GRAVITY_M_S2])
    wanted = acceleration + parameters[PARAMETER_DRAG] * velocity + gravity - parameters[PARAMETER_FORCE]
    up = ca.fmin(ca.fmax(wanted[2], ca.fmax(least, LEAST_LIFT_M_S2)), VERTICAL_SHARE * largest)
    length = ca.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + 1e-12)
    shortened = ca.fmin(1.0, ca.sqrt(largest**2 - up**2) / length)
    forward = shortened * (ca.cos(yaw) * wanted[0] + ca.sin(yaw) * wanted[1])
    left = shortened * (ca.cos(yaw) * wanted[1] - ca.sin(yaw) * wanted[0])
    largest_pitch = parameters[PARAMETER_GAIN_PITCH] * tilt
    largest_roll = parameters[PARAMETER_GAIN_ROLL] * tilt
    pitch = ca.fmin(ca.fmax(ca.atan2(forward, up), -largest_pitch), largest_pitch)
    roll = ca.fmin(ca.fmax(ca.atan2(-left * ca.cos(pitch), up), -largest_roll), largest_roll)
    thrust = up / (k_thrust * ca.cos(pitch) * ca.cos(roll))
    return ca.vertcat(roll, pitch, ca.fmin(ca.fmax(thrust, limits[1]), limits[2]))
