"""The sixth-order model that the disturbance observers work with (Asignacion et al. 2022, eq. 13).

State x = (vx, vy, vz, p, q, r): velocity in the world (ENU) [m/s] and body rates (FLU) [rad/s]. Its inputs are virtual:
u = (force of thrust and weight in the world [N], torque of the rotors in the body [N m]), so that

    x' = A(p, q, r) x + B (u + d),   d = disturbance: three forces in the world [N], three torques in the body [N m].

A holds the gyroscopic coupling and a linear damping, B the reciprocals of mass and inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.errors import UasflyError
from uasfly.frames import rotation_matrix
from uasfly.messages import Array

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
FORCES = slice(0, 3)  # [N] in the world; in the state: velocity [m/s]
TORQUES = slice(3, 6)  # [N m] in the body; in the state: rates [rad/s]


@dataclass(frozen=True, slots=True)
class SixAxisBody:
    """Mass properties of the model.

    Attributes:
        mass_kg: mass.
        inertia_kg_m2: principal moments about the body's x, y, z.
        damping: linear, the same number for every axis: [N s/m] on velocities, [N m s/rad] on rates.
    """

    mass_kg: float
    inertia_kg_m2: tuple[float, float, float]
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("mass_kg", self.mass_kg), *(("inertia_kg_m2", value) for value in self.inertia_kg_m2)):
            if not (math.isfinite(value) and value > 0.0):
                raise UasflyError(f"{name}: expected a positive number, found {value}")
        if not (math.isfinite(self.damping) and self.damping >= 0.0):
            raise UasflyError(f"damping: expected a number that is not negative, found {self.damping}")

    @property
    def inertias(self) -> Array:
        """Mass [kg], three times, and the moments of inertia [kg m^2]: shape (6,), the reciprocal of B's diagonal."""
        return np.array((self.mass_kg, self.mass_kg, self.mass_kg, *self.inertia_kg_m2))

    def system_matrix(self, rates_rad_s: Array) -> Array:
        """A(p, q, r), shape (6, 6).

        Euler's p' = (Iy - Iz)/Ix q r is written half as q's, half as r's share, so that A is affine in the three rates.
        """
        p, q, r = rates_rad_s.tolist()
        ix, iy, iz = self.inertia_kg_m2
        roll, pitch, yaw = 0.5 * (iy - iz) / ix, 0.5 * (iz - ix) / iy, 0.5 * (ix - iy) / iz
        matrix: Array = np.diag(-self.damping / self.inertias)
        matrix[3, 4], matrix[3, 5] = roll * r, roll * q
        matrix[4, 3], matrix[4, 5] = pitch * r, pitch * p
        matrix[5, 3], matrix[5, 4] = yaw * q, yaw * p
        return matrix

    def virtual_inputs(self, quaternion_body_to_world: Array, thrust_n: float, torque_in_body_nm: Array) -> Array:
        """u, shape (6,): thrust along the body's z and weight, in the world [N]; torque in the body [N m]."""
        inputs = np.empty(6)
        inputs[FORCES] = thrust_n * rotation_matrix(quaternion_body_to_world)[:, 2]
        inputs[2] -= self.mass_kg * GRAVITY_M_S2
        inputs[TORQUES] = torque_in_body_nm
        return inputs
