"""Rotors: speed lag, thrust and drag torque, thrust changed by inflow, flapping drag, symbolically (CasADi).

Inflow. With a rotor's thrust at hover T_h = k w^2 and its hover inflow v_h = sqrt(T_h / (2 rho A)), and airspeeds over
v_h: `axial` a (positive: climbing, air falls through the disc) and `in_plane` b, momentum theory gives the induced
inflow x from x sqrt(b^2 + (a + x)^2) = T / T_h (Waslander & Wang 2009, after Glauert; Leishman, Principles of
Helicopter Aerodynamics, 2.13). Waslander closes the equation with constant power. Here the rotor's speed is the state,
so blade-element theory at constant speed and pitch closes it instead, where thrust falls linearly with the total inflow
(Leishman, 3.2): T / T_h = 1 - s (a + x - 1), s = solidity * lift slope / (8 * hover inflow ratio), about 1.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from uasfly.sim.plant import AIR_DENSITY_KG_M3, Rotors

_NEWTON_STEPS = 2
_SMALLEST_HOVER_INFLOW_M_S = 0.5  # keeps the airspeed ratios finite while a rotor stands still
_LARGEST_RATIO = 3.0  # momentum theory says nothing useful about faster airspeeds than this many v_h


class RotorWrench(NamedTuple):
    """Sum over the rotors, in body axes about the centre of mass, and the speeds' derivative."""

    force: ca.SX
    torque: ca.SX
    acceleration: ca.SX


def thrust_ratio(axial: ca.SX, in_plane_squared: ca.SX, slope: float) -> tuple[ca.SX, ca.SX]:
    """Thrust over hover thrust at the same speed, and its derivative by the axial airspeed ratio.

    Args:
        axial: airspeed through the disc over v_h, positive when climbing.
        in_plane_squared: square of (airspeed along the disc over v_h).
        slope: s of the module's text.
    """
    # The start solves the equation with sqrt(b^2 + lambda^2) taken at lambda = 1; two Newton steps bring 1e-4.
    root = ca.sqrt(in_plane_squared + 1.0)
    inflow = (1.0 + slope + axial * root) / (slope + root)
    for _ in range(_NEWTON_STEPS):
        root = ca.sqrt(in_plane_squared + inflow * inflow + 1e-9)
        residual = (inflow - axial) * root + slope * (inflow - 1.0) - 1.0
        inflow = inflow - residual / (root + (inflow - axial) * inflow / root + slope)
    root = ca.sqrt(in_plane_squared + inflow * inflow + 1e-9)
    by_axial = -slope * root / (root + (inflow - axial) * inflow / root + slope)
    return 1.0 - slope * (inflow - 1.0), by_axial


def rotor_wrench(
    rotors: Rotors, speeds: ca.SX, targets: ca.SX, effectiveness: ca.SX, air_in_body: ca.SX, rate: ca.SX
) -> RotorWrench:
    """Force [N] and torque [N m] of all rotors and the derivative of their speeds [rad/s^2].

    All rotors share the inflow of the mean rotor at the body origin; what the angular rate adds at each arm enters
    linearly and damps roll and pitch.

    Args:
        rotors: physical figures.
        speeds: (n,) [rad/s].
        targets: (n,) speeds [rad/s] that the speed controllers aim at.
        effectiveness: (n,) thrust over the thrust of a sound rotor, 1 without faults.
        air_in_body: (3,) velocity of the air relative to the vehicle [m/s], without jets.
        rate: (3,) angular rate in the body [rad/s].
    """
    xs = ca.vertcat(*(x for x, _ in rotors.positions_m))
    ys = ca.vertcat(*(y for _, y in rotors.positions_m))
    spins = ca.DM(rotors.spins)
    power = speeds * speeds if rotors.speed_exponent == 2 else speeds
    thrusts = rotors.thrust_coefficient * effectiveness * power
    acceleration = (targets - speeds) / rotors.lag_s
    if rotors.thrust_law == "quadratic":
        mean_thrust = rotors.thrust_coefficient * ca.sum1(power) / rotors.count
        floor = _SMALLEST_HOVER_INFLOW_M_S**2
        hover_inflow = ca.sqrt(mean_thrust / (2.0 * AIR_DENSITY_KG_M3 * rotors.disc_area_m2) + floor)
        axial = ca.fmax(-_LARGEST_RATIO, ca.fmin(_LARGEST_RATIO, -air_in_body[2] / hover_inflow))
        in_plane_squared = (air_in_body[0] ** 2 + air_in_body[1] ** 2) / hover_inflow**2
        ratio, by_axial = thrust_ratio(axial, ca.fmin(_LARGEST_RATIO**2, in_plane_squared), rotors.inflow_slope)
        climb_of_arm = (rate[0] * ys - rate[1] * xs) / hover_inflow
        thrusts = thrusts * (ratio + by_axial * climb_of_arm)
    drag_torques = rotors.torque_per_thrust_m * rotors.thrust_coefficient * power
    # A spinning-up rotor turns the body the other way; the sum of the spins makes a gyroscope of the whole.
    yaw = -ca.dot(spins, drag_torques + rotors.inertia_kg_m2 * acceleration)
    momentum = rotors.inertia_kg_m2 * ca.dot(spins, speeds)
    flapping = rotors.flapping_kg * ca.sum1(speeds) * air_in_body
    force = ca.vertcat(flapping[0], flapping[1], ca.sum1(thrusts))
    torque = ca.vertcat(
        ca.dot(ys, thrusts) - rotors.height_m * flapping[1] - rate[1] * momentum,
        -ca.dot(xs, thrusts) + rotors.height_m * flapping[0] + rate[0] * momentum,
        yaw,
    )
    return RotorWrench(force, torque, acceleration)
