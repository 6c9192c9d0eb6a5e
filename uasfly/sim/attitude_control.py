"""Attitude control: reference model and tilt-prioritised quaternion feedback, symbolically (CasADi).

The feedback is that of Brescianini, Hehn & D'Andrea (Nonlinear Quadrocopter Attitude Control, ETH 2013), as PX4 uses
it: the error is split into a tilt and a yaw after it, and yaw counts less. PX4 filters the setpoint through a
critically damped model of second order first (MC_REF_W_N) and adds the commanded yaw rate as feed-forward.
"""

from __future__ import annotations

import casadi as ca

from uasfly.sim.body import normalised, quaternion_product, rotation_body_to_world


def _conjugate(quaternion: ca.SX) -> ca.SX:
    return ca.vertcat(quaternion[0], -quaternion[1:])


def _short_way(quaternion: ca.SX) -> ca.SX:
    """The same rotation with w >= 0."""
    return ca.if_else(quaternion[0] < 0.0, -quaternion, quaternion)


def follow_reference_model(
    reference: ca.SX, rate: ca.SX, setpoint: ca.SX, yaw_rate: ca.SX, frequency: ca.SX, step_s: float
) -> tuple[ca.SX, ca.SX]:
    """Reference attitude (4,) and its rate (3,) [rad/s] a step later.

    In the tangent space of the reference the error e to the setpoint obeys e' = -r, r' = w^2 e - 2 w r, a critically
    damped system whose step is the exact matrix exponential; the commanded yaw rate turns the reference besides.

    Args:
        reference: (4,) reference attitude.
        rate: (3,) its rate towards the setpoint, in its own axes.
        setpoint: (4,) attitude asked for.
        yaw_rate: commanded about the world's vertical [rad/s].
        frequency: w [rad/s].
        step_s: time step.
    """
    error = 2.0 * _short_way(quaternion_product(_conjugate(reference), setpoint))[1:]
    phase = frequency * step_s
    decay = ca.exp(-phase)
    vertical = rotation_body_to_world(reference)[2, :].T
    turn = error - decay * ((1.0 + phase) * error - step_s * rate) + step_s * yaw_rate * vertical
    next_rate = decay * (frequency**2 * step_s * error + (1.0 - phase) * rate)
    half = 0.5 * turn
    return normalised(quaternion_product(reference, ca.vertcat(1.0, half))), next_rate


def rate_setpoint(
    attitude: ca.SX, reference: ca.SX, yaw_rate: ca.SX, gains: ca.SX, yaw_weight: ca.SX, limits: ca.SX
) -> ca.SX:
    """Angular rate (3,) [rad/s] in the body that turns the vehicle towards the reference attitude.

    Args:
        attitude: (4,) estimated attitude.
        reference: (4,) attitude to follow.
        yaw_rate: feed-forward about the world's vertical [rad/s].
        gains: (3,) of roll, pitch and yaw [1/s].
        yaw_weight: 0..1.
        limits: (3,) largest rates [rad/s].
    """
    w, x, y, z = ca.vertsplit(_short_way(quaternion_product(_conjugate(attitude), reference)))
    # error = tilt * yaw with the tilt's axis in the body's xy plane and the yaw's axis along z
    length = ca.sqrt(w * w + z * z + 1e-12)
    tilt_x, tilt_y = (w * x - y * z) / length, (w * y + x * z) / length
    half_yaw = yaw_weight * ca.atan2(z, w)
    cosine, sine = ca.cos(half_yaw), ca.sin(half_yaw)
    error = 2.0 * ca.vertcat(
        tilt_x * cosine + tilt_y * sine, tilt_y * cosine - tilt_x * sine, length * sine / ca.fmax(yaw_weight, 1e-3)
    )
    vertical_in_body = rotation_body_to_world(attitude)[2, :].T
    wanted = gains * error + yaw_rate * vertical_in_body
    return ca.fmax(-limits, ca.fmin(limits, wanted))
