"""The simulated quadrotor of Asignacion et al. 2022: six axes, a gust, and dynamics that are not quite the model's.

    v' = (1 + delta) (u_f - k v) / m + d_f / m,    w' = (1 + delta) J^-1 (u_t - k w - w x J w) + J^-1 d_t

How the uncertainty delta enters: the paper multiplies the *dynamics* of an axis by 1 + delta. The dynamics are its
model (13), A x + B u, weight included in the virtual input; the gust d acts from outside and is what the observer is to
find, so it is not multiplied. (Multiplied too, a well-controlled vehicle would feel next to nothing of delta, because u
balances d, and DP2 would be the better one on most axes, which is not what the paper found.) What other readings give:
see `uasfly.reproduce.asignacion2022.uncertainty`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array
from uasfly.wind.six_axes import SixAxisBody

SixFloats = tuple[float, float, float, float, float, float]
Disturbance = Callable[[float, tuple[float, float, float]], SixFloats]
"""Of time [s] and velocity in the world [m/s]: force in the world [N], torque in the body [N m]."""

NOMINAL: SixFloats = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
_State = tuple[float, ...]


class Vehicle:
    """Rigid body with thrust along its z and torques as inputs, stepped by Runge-Kutta of fourth order.

    The plain floats are for speed; attitude is a quaternion, body to world.

    Args:
        body: mass properties.
        position_m, velocity_m_s: at the beginning, world; the attitude is level, yaw 0.
        disturbance: what acts from outside.
    """

    def __init__(self, body: SixAxisBody, position_m: Array, velocity_m_s: Array, disturbance: Disturbance) -> None:
        self._body = body
        self._disturbance = disturbance
        self._state: _State = (*position_m.tolist(), *velocity_m_s.tolist(), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.time_s = 0.0

    @property
    def position_m(self) -> Array:
        """(3,) in the world [m]."""
        return np.array(self._state[0:3])

    @property
    def quaternion(self) -> Array:
        """(4,) body to world."""
        return np.array(self._state[6:10])

    @property
    def state(self) -> Array:
        """(6,) of the six-axis model: velocity in the world [m/s], body rates [rad/s]."""
        return np.array((*self._state[3:6], *self._state[10:13]))

    @property
    def disturbance(self) -> Array:
        """(6,) that acts now."""
        vx, vy, vz = self._state[3:6]
        return np.array(self._disturbance(self.time_s, (vx, vy, vz)))

    def step(self, step_s: float, thrust_n: float, torque_nm: Array, factors: SixFloats) -> None:
        """Go on by a step with thrust, torque and the six 1 + delta held."""
        torque = (*torque_nm.tolist(),)
        state, time_s = self._state, self.time_s

        def slope(after_s: float, along: _State | None) -> _State:
            moved = state if along is None else tuple(a + after_s * b for a, b in zip(state, along, strict=True))
            return self._derivative(time_s + after_s, moved, thrust_n, torque, factors)

        k1 = slope(0.0, None)
        k2 = slope(0.5 * step_s, k1)
        k3 = slope(0.5 * step_s, k2)
        k4 = slope(step_s, k3)
        sixth = step_s / 6.0
        moved = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)]
        norm = math.sqrt(sum(part * part for part in moved[6:10]))
        moved[6:10] = [part / norm for part in moved[6:10]]
        self._state = tuple(moved)
        self.time_s = time_s + step_s

    def _derivative(
        self, time_s: float, state: _State, thrust_n: float, torque_nm: tuple[float, ...], factors: SixFloats
    ) -> _State:
        _, _, _, vx, vy, vz, w, x, y, z, p, q, r = state
        mass, damping = self._body.mass_kg, self._body.damping
        ix, iy, iz = self._body.inertia_kg_m2
        fx, fy, fz, tx, ty, tz = self._disturbance(time_s, (vx, vy, vz))
        by_x, by_y, by_z, by_roll, by_pitch, by_yaw = factors
        return (
            vx,
            vy,
            vz,
            (by_x * (thrust_n * 2.0 * (x * z + w * y) - damping * vx) + fx) / mass,
            (by_y * (thrust_n * 2.0 * (y * z - w * x) - damping * vy) + fy) / mass,
            (by_z * (thrust_n * (1.0 - 2.0 * (x * x + y * y)) - mass * GRAVITY_M_S2 - damping * vz) + fz) / mass,
            0.5 * (-x * p - y * q - z * r),
            0.5 * (w * p + y * r - z * q),
            0.5 * (w * q - x * r + z * p),
            0.5 * (w * r + x * q - y * p),
            (by_roll * (torque_nm[0] - damping * p + (iy - iz) * q * r) + tx) / ix,
            (by_pitch * (torque_nm[1] - damping * q + (iz - ix) * p * r) + ty) / iy,
            (by_yaw * (torque_nm[2] - damping * r + (ix - iy) * p * q) + tz) / iz,
        )
