"""Mixer: normalised torques and thrust to motor commands, symbolically (CasADi), for any planar rotor layout.

Geometry and normalisation are PX4's control allocation for multirotors (pseudo-inverse; roll and pitch scaled alike,
yaw to its largest entry, thrust to one), so that PX4's rate gains mean the same here. When a motor would saturate, yaw
gives way first, then thrust (only downwards, as with PX4's airmode off), then roll and pitch together.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from uasfly.messages import Array
from uasfly.sim.plant import Rotors

ROLL, PITCH, YAW, THRUST = range(4)


class Mix(NamedTuple):
    """Motor commands (n,), 0..1 of full thrust, and the share 0..1 of the asked torques (3,) that they keep."""

    motors: ca.SX
    kept: ca.SX


def mixing_matrix(rotors: Rotors) -> Array:
    """Matrix (n, 4) from normalised roll, pitch and yaw torque (body axes) and thrust to motor commands."""
    positions, spins = np.array(rotors.positions_m), np.array(rotors.spins)
    effect = np.vstack((positions[:, 1], -positions[:, 0], -spins * rotors.torque_per_thrust_m, np.ones(rotors.count)))
    mix = np.linalg.pinv(effect)
    mix[np.abs(mix) < 1e-9 * np.abs(mix).max(axis=0)] = 0.0  # what is left of zeros, in each column's own unit
    tilting = np.count_nonzero(mix[:, :2], axis=0)
    mix[:, :2] /= np.sqrt((mix[:, :2] ** 2).sum(axis=0) / (tilting / 2.0)).max()
    mix[:, YAW] /= np.abs(mix[:, YAW]).max()
    mix[:, THRUST] /= mix[:, THRUST].mean()
    return np.asarray(mix)


def mix_commands(matrix: ca.SX, torque: ca.SX, thrust: ca.SX) -> Mix:
    """Motor commands for normalised torques (3,) and a normalised thrust 0..1, by a `mixing_matrix` (n, 4)."""
    matrix = ca.SX(matrix)
    tilt = matrix[:, :2] @ torque[:2]
    yaw = matrix[:, YAW] * torque[YAW]
    highest, lowest = ca.mmax(tilt), ca.mmin(tilt)
    tilt_kept = ca.fmin(1.0, 1.0 / ca.fmax(highest - lowest, 1e-9))
    lift = ca.fmax(0.0, ca.fmin(thrust, 1.0 - tilt_kept * highest))
    tilt_kept = ca.fmin(tilt_kept, lift / ca.fmax(-lowest, 1e-9))
    base = lift + tilt_kept * tilt
    room_above, room_below = ca.fmax(0.0, 1.0 - base), ca.fmax(0.0, base)
    rising, falling = ca.fmax(yaw, 1e-9), ca.fmax(-yaw, 1e-9)
    yaw_kept = ca.fmin(1.0, ca.fmin(ca.mmin(room_above / rising), ca.mmin(room_below / falling)))
    motors = ca.fmax(0.0, ca.fmin(1.0, base + yaw_kept * yaw))
    return Mix(motors, ca.vertcat(tilt_kept, tilt_kept, yaw_kept))
