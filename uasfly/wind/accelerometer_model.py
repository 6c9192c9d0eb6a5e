"""What an accelerometer on a multirotor reads in wind: thrust, blade flapping and drag (Waslander & Wang 2009, eq. 28).

Specific force in the body (FLU), with u the velocity of the air relative to the vehicle, in the body:

    f = [ (c_p + c_q |u|) u_x,  (c_p + c_q |u|) u_y,  T_h C(u) + (c_a + c_q |u|) u_z ]

c_p holds the flapping force K_bf v cos(alpha) along the rotor plane and the linear part of the drag C_D v; c_q is a
bluff body's quadratic drag, which the paper has none of (0 gives its model). C(u) is the thrust ratio of `momentum`.
All of it over the mass. Gravity is not in it: an accelerometer does not feel it.

The rotor plane's components do not contain the thrust: a level hover reads the horizontal wind from them directly. The
component along the thrust is another matter: air from above takes thrust away (T_h / (3 v_h) for each m/s at hover,
0.6 1/s on a 1.8 kg hexacopter), several times what the drag there gives. The paper takes the thrust with the last wind
estimate and divides the rest by the drag; that repeats to an answer only where the drag is the larger of the two, and
runs away where it is not. `wind_from_specific_force` solves all three equations at once by Newton's method instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.wind.momentum import hover_inflow_m_s, thrust_ratio

_SMALLEST_INFLOW_M_S = 0.5  # keeps the airspeed ratios finite at idle thrust
_SMALLEST_SPEED_M_S = 1e-9
_MOST_STEPS = 12
_TOLERANCE_M_S = 1e-9
_LONGEST_STEP_M_S = 5.0


@dataclass(frozen=True, slots=True)
class AccelerometerModel:
    """Coefficients of eq. 28, over the mass.

    Attributes:
        in_plane_1_s: c_p, force along the rotor plane over the airspeed along it [1/s].
        axial_1_s: c_a, the same along the thrust, without what the rotors' inflow does [1/s].
        quadratic_1_m: c_q, drag over the square of the airspeed [1/m].
        disc_area_per_mass_m2_kg: area of all discs for each kilogram of the vehicle.
    """

    in_plane_1_s: float
    axial_1_s: float
    quadratic_1_m: float
    disc_area_per_mass_m2_kg: float

    def specific_force(self, air_in_body: Array, static_thrust_m_s2: float) -> Array:
        """Specific force (3,) [m/s^2] in the body.

        Args:
            air_in_body: (3,) velocity of the air relative to the vehicle [m/s].
            static_thrust_m_s2: T_h over the mass: the thrust that command and voltage give in still air.
        """
        return self.with_jacobian(air_in_body, static_thrust_m_s2)[0]

    def drag(self, air_in_body: Array) -> Array:
        """Its part (3,) [m/s^2] that is not thrust: what the air along the rotor plane and around the body does."""
        x, y, z = air_in_body.tolist()
        quadratic = self.quadratic_1_m * math.sqrt(x * x + y * y + z * z)
        in_plane = self.in_plane_1_s + quadratic
        return np.array((in_plane * x, in_plane * y, (self.axial_1_s + quadratic) * z))

    def with_jacobian(self, air_in_body: Array, static_thrust_m_s2: float) -> tuple[Array, Array]:
        """Specific force (3,) and its derivative (3, 3) by the air's velocity [1/s]."""
        x, y, z = air_in_body.tolist()
        inflow = max(hover_inflow_m_s(static_thrust_m_s2, self.disc_area_per_mass_m2_kg), _SMALLEST_INFLOW_M_S)
        along = math.hypot(x, y)
        ratio = thrust_ratio(-z / inflow, along / inflow)
        speed = math.sqrt(x * x + y * y + z * z)
        in_plane = self.in_plane_1_s + self.quadratic_1_m * speed
        axial = self.axial_1_s + self.quadratic_1_m * speed
        force = np.array((in_plane * x, in_plane * y, static_thrust_m_s2 * ratio.value + axial * z))
        jacobian = np.diag((in_plane, in_plane, axial))
        if speed > _SMALLEST_SPEED_M_S:
            jacobian += self.quadratic_1_m / speed * np.outer(air_in_body, air_in_body)
        by_air = static_thrust_m_s2 / inflow
        jacobian[2, 2] -= by_air * ratio.by_axial
        if along > _SMALLEST_SPEED_M_S:
            jacobian[2, 0] += by_air * ratio.by_in_plane * x / along
            jacobian[2, 1] += by_air * ratio.by_in_plane * y / along
        return force, jacobian

    def air_from_specific_force(self, specific_force: Array, static_thrust_m_s2: float, start: Array) -> Array:
        """Velocity (3,) [m/s] of the air relative to the vehicle, in the body, that gives a specific force (3,).

        Args:
            specific_force: (3,) [m/s^2], measured, without the accelerometer's bias.
            static_thrust_m_s2: see `specific_force`.
            start: (3,) where Newton's method begins: the last answer.
        """
        air = np.array(start, dtype=np.float64)
        for _ in range(_MOST_STEPS):
            force, jacobian = self.with_jacobian(air, static_thrust_m_s2)
            step = np.linalg.solve(jacobian, specific_force - force)
            length = float(np.linalg.norm(step))
            air = air + step * min(1.0, _LONGEST_STEP_M_S / max(length, _SMALLEST_SPEED_M_S))
            if length < _TOLERANCE_M_S:
                break
        return air


def wind_from_specific_force(
    model: AccelerometerModel,
    specific_force: Array,
    static_thrust_m_s2: float,
    body_to_world: Array,
    velocity_in_world: Array,
    last_wind_in_world: Array,
) -> Array:
    """Wind (3,) [m/s] in the world by inversion (Waslander & Wang 2009, eq. 30).

    Args:
        model: eq. 28 of this vehicle.
        specific_force: (3,) [m/s^2] measured in the body. Whatever bias is in it goes into the wind, divided by the
            drag coefficient: 0.1 m/s^2 are 0.3 m/s at 0.35 1/s.
        static_thrust_m_s2: T_h of the present command and voltage over the mass.
        body_to_world: (3, 3) rotation matrix.
        velocity_in_world: (3,) of the vehicle [m/s].
        last_wind_in_world: (3,) the last answer [m/s].
    """
    start = body_to_world.T @ (last_wind_in_world - velocity_in_world)
    air = model.air_from_specific_force(specific_force, static_thrust_m_s2, start)
    return np.asarray(body_to_world @ air + velocity_in_world)
