"""Wind vector and covariance from the thrust-free force, through the identified drag."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array
from uasfly.wind.drag_curve import DragCurve

_ITERATIONS = 16  # a climb of 2 m/s leaves 0.1 mm/s

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Standard deviations of what goes into a wind.

    Attributes:
        force_m_s2: of the force, one axis.
        velocity_m_s: of the vehicle's velocity, one axis.
        tilt_rad: of the attitude about horizontal axes: it leaks gravity into the force.
        drag_share: of the drag at a given airspeed, relative.
        vertical_m_s: of the vertical wind, which is taken as zero.
        unsteady_share: of the airspeed: rotors do not follow gusts and thrust as in steady flight.
    """

    force_m_s2: float
    velocity_m_s: float
    tilt_rad: float
    drag_share: float
    vertical_m_s: float
    unsteady_share: float


def air_relative(force: Pair, slope: Pair, velocity_up_m_s: float, curve: DragCurve) -> tuple[Pair, float]:
    """Velocity of the air relative to the vehicle (east, north) [m/s] and the size of all of it [m/s].

    Solves h = k(|u|) (u_h - s u_z) of `thrust_free` for u_h, with no vertical wind.

    Args:
        force: h [m/s^2], east and north.
        slope: s, east and north.
        velocity_up_m_s: of the vehicle.
        curve: the drag.
    """
    size_h = math.hypot(*force)
    up = -velocity_up_m_s
    shift_east, shift_north = slope[0] * up, slope[1] * up
    speed = curve.airspeed(size_h)
    for _ in range(_ITERATIONS):
        ratio = curve.ratio(speed)
        east, north = force[0] / ratio + shift_east, force[1] / ratio + shift_north
        if up == 0.0:
            break
        speed = math.sqrt(east * east + north * north + up * up)
    return (east, north), math.sqrt(east * east + north * north + up * up)


def wind_covariance(force: Pair, slope: Pair, speed_m_s: float, curve: DragCurve, sigma: Uncertainty) -> Array:
    """Covariance (2, 2) [m^2/s^2] of the wind, to first order and for airspeeds that are mostly horizontal.

    Args:
        force: h [m/s^2].
        slope: s.
        speed_m_s: airspeed.
        curve: the drag.
        sigma: of everything else.
    """
    size = math.hypot(*force)
    along_east, along_north = (force[0] / size, force[1] / size) if size > 0.0 else (1.0, 0.0)
    spread = sigma.force_m_s2**2 + (GRAVITY_M_S2 * sigma.tilt_rad) ** 2
    along = (spread + (sigma.drag_share * size) ** 2) / curve.slope(speed_m_s) ** 2
    across = spread / curve.ratio(speed_m_s) ** 2
    difference = along - across
    plain = across + sigma.velocity_m_s**2 + (sigma.unsteady_share * speed_m_s) ** 2
    vertical = sigma.vertical_m_s**2
    mixed = difference * along_east * along_north + vertical * slope[0] * slope[1]
    return np.array(
        (
            (plain + difference * along_east**2 + vertical * slope[0] ** 2, mixed),
            (mixed, plain + difference * along_north**2 + vertical * slope[1] ** 2),
        )
    )
