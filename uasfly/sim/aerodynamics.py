"""Drag of the body (frame, battery, legs) in the wind relative to the vehicle, symbolically (CasADi)."""

from __future__ import annotations

import casadi as ca

from uasfly.sim.plant import AIR_DENSITY_KG_M3, BodyDrag


def body_drag_force(drag: BodyDrag, air_in_body: ca.SX) -> ca.SX:
    """Force (3,) [N] in the body: bluff-body drag rho/2 C_D A |u| u and a linear part (Waslander & Wang 2009, C_D v).

    Args:
        drag: figures of the body.
        air_in_body: (3,) velocity of all air, jets included, relative to the vehicle [m/s].
    """
    linear = ca.vertcat(*drag.linear_n_s_m) * air_in_body
    speed = ca.sqrt(ca.dot(air_in_body, air_in_body) + 1e-12)  # the root's derivative must exist in still air
    return linear + 0.5 * AIR_DENSITY_KG_M3 * ca.vertcat(*drag.area_m2) * speed * air_in_body


def body_drag_torque(drag: BodyDrag, rate: ca.SX) -> ca.SX:
    """Torque (3,) [N m] against the angular rate (3,) [rad/s] in the body."""
    return -ca.vertcat(*drag.angular_n_m_s) * rate
