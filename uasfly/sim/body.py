"""Rigid body: layout of the plant's state and the kinematics that every force needs, symbolically (CasADi).

World frame ENU, body frame FLU, quaternion Hamilton, w first, body to world. The simulation has its own copy of these
few lines on purpose: it must share nothing with the model that controller and observer use.
"""

from __future__ import annotations

import casadi as ca

GRAVITY_M_S2 = 9.80665

POSITION = slice(0, 3)  # m, world, of the centre of mass; z = 0 where the vehicle rests on the ground
VELOCITY = slice(3, 6)  # m/s, world
ATTITUDE = slice(6, 10)  # unit quaternion, body to world
ANGULAR_RATE = slice(10, 13)  # rad/s, body
ROTOR_SPEED = slice(13, None)  # rad/s, one a rotor
BODY_STATES = 13


def rotation_body_to_world(quaternion: ca.SX) -> ca.SX:
    """Rotation matrix (3, 3) of a unit quaternion (4,)."""
    w, x, y, z = ca.vertsplit(quaternion)
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def quaternion_product(left: ca.SX, right: ca.SX) -> ca.SX:
    """Hamilton product (4,)."""
    w1, x1, y1, z1 = ca.vertsplit(left)
    w2, x2, y2, z2 = ca.vertsplit(right)
    return ca.vertcat(
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
    )


def normalised(quaternion: ca.SX) -> ca.SX:
    """Quaternion (4,) scaled to unit length."""
    return quaternion / ca.sqrt(ca.dot(quaternion, quaternion))


def body_derivative(
    state: ca.SX,
    force_in_world: ca.SX,
    torque_in_body: ca.SX,
    mass_kg: float,
    inertia_kg_m2: tuple[float, float, float],
) -> ca.SX:
    """Time derivative (13,) of position, velocity, attitude and angular rate (Newton, Euler; q' = q * (0, omega) / 2).

    Args:
        state: plant state; only the first 13 entries are read.
        force_in_world: (3,) [N], without gravity.
        torque_in_body: (3,) [N m] about the centre of mass.
        mass_kg: mass.
        inertia_kg_m2: principal moments about the body axes.
    """
    rate = state[ANGULAR_RATE]
    inertia = ca.vertcat(*inertia_kg_m2)
    acceleration = force_in_world / mass_kg - ca.DM((0.0, 0.0, GRAVITY_M_S2))
    spin = 0.5 * quaternion_product(state[ATTITUDE], ca.vertcat(0.0, rate))
    return ca.vertcat(state[VELOCITY], acceleration, spin, (torque_in_body - ca.cross(rate, inertia * rate)) / inertia)
