"""The wind's horizontal force from velocity and attitude alone: neither the thrust nor its errors come into it.

With the drag in the plane of the rotors and all else along the body's z axis, v' = a_z z_B - g + R [f_x, f_y, 0].
The part along z_B is unknown: the thrust's map, the battery and the inflow are in it, and at 20 deg of tilt a third of
their errors is horizontal. Eliminating it with the vertical row leaves, with s = (z_B east, z_B north) / (z_B up),

    h = v'_h - s (g + v'_z),     h = k(|u|) (u_h - s u_z)

where u is the air's velocity relative to the vehicle and k = drag / airspeed: the same 2 x 2 matrix takes f to h and
the body's components of u to u_h - s u_z, so that the body's axes drop out. The derivatives are never taken: the
integral of h,

    y(t) = v_h - integral of s (g dt + dv_z),

goes to `force_kernel`. The thrust itself, where it is wanted, is (g + v'_z) / (z_B up), but for the drag's vertical
part.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array


def slopes(quaternions: Array) -> Array:
    """Horizontal over vertical part (n, 2) of the body's z axis in the world, for unit quaternions (n, 4)."""
    w, x, y, z = quaternions.T
    up = 1.0 - 2.0 * (x * x + y * y)
    result: Array = np.column_stack((2.0 * (x * z + w * y), 2.0 * (y * z - w * x))) / up[:, None]
    return result


def impulses(times_s: Array, velocities: Array, slopes_of: Array) -> Array:
    """Increments (n - 1, 2) [m/s] of y between samples.

    Args:
        times_s: (n,) rising.
        velocities: (n, 3) m/s, world.
        slopes_of: (n, 2), see `slopes`.
    """
    steps = np.diff(velocities, axis=0)
    mean_slope = 0.5 * (slopes_of[1:] + slopes_of[:-1])
    lift = GRAVITY_M_S2 * np.diff(times_s) + steps[:, 2]
    result: Array = steps[:, :2] - mean_slope * lift[:, None]
    return result


def thrust(vertical_acceleration_m_s2: float, slope: tuple[float, float]) -> float:
    """Thrust [m/s^2] from the vertical acceleration and the slope of the body's z axis."""
    return (GRAVITY_M_S2 + vertical_acceleration_m_s2) * math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
