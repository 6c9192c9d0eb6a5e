"""Takes a reference from where the vehicle is to where it should be without a step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import Limits
from uasfly.messages import Array, ReferenceHorizon
from uasfly.mission import Transition

SHORTEST_S = 2.0
PEAK_SPEED = 1.875  # of the profile, times way over duration
PEAK_ACCELERATION = 5.774  # times way over duration squared


@dataclass(frozen=True, slots=True)
class Glide:
    """An offset that fades out: 1 - (10 s^3 - 15 s^4 + 6 s^5) over `duration_s`; two derivatives are continuous.

    Attributes:
        offset_m: (3,) where the vehicle is minus where the reference begins.
        yaw_offset_rad: the same for yaw.
        start_s: when it begins, on the clock of the reference's times.
        duration_s: how long it takes.
    """

    offset_m: Array
    yaw_offset_rad: float
    start_s: float
    duration_s: float

    def offset_at(self, time_s: float) -> tuple[float, float, float]:
        """What is left of the offset [m] at one time of the clock [s]."""
        s = min(max((time_s - self.start_s) / self.duration_s, 0.0), 1.0)
        share = 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        x, y, z = self.offset_m.tolist()
        return share * x, share * y, share * z

    def onto(self, reference: ReferenceHorizon) -> ReferenceHorizon:
        """The reference with the rest of the offset added; the same object once it has faded out."""
        times = reference.time_s
        if float(times[0]) >= self.start_s + self.duration_s:
            return reference
        share, speed, acceleration = faded((times - self.start_s) / self.duration_s, self.duration_s)
        return ReferenceHorizon(
            times,
            reference.position_in_world + np.outer(share, self.offset_m),
            reference.velocity_in_world + np.outer(speed, self.offset_m),
            reference.acceleration_in_world + np.outer(acceleration, self.offset_m),
            reference.yaw_rad + share * self.yaw_offset_rad,
            reference.yaw_rate_rad_s + speed * self.yaw_offset_rad,
        )


def faded(share_of_time: Array, duration_s: float) -> tuple[Array, Array, Array]:
    """What is left (n,) of something that fades out, and its first [1/s] and second [1/s^2] derivative.

    Args:
        share_of_time: (n,) of the duration that has gone by; clipped to 0..1.
        duration_s: the whole.
    """
    s = np.clip(share_of_time, 0.0, 1.0)
    share = 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    speed = -30.0 * s**2 * (1.0 - s) ** 2 / duration_s
    acceleration = -60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration_s**2
    return share, speed, acceleration


def glide_time_s(offset_m: Array, turn_rad: float, transition: Transition, limits: Limits) -> float:
    """Time for a glide over an offset (3,) [m] and a turn [rad] within speeds, acceleration and yaw rate."""
    x, y, z = offset_m.tolist()
    way = math.sqrt(x * x + y * y + z * z)
    speed = min(transition.speed_m_s, limits.speed_m_s)
    acceleration = min(transition.acceleration_m_s2, limits.acceleration_m_s2)
    vertical = limits.descent_m_s if z > 0.0 else limits.climb_m_s  # the glide goes against the offset
    longest: float = max(
        SHORTEST_S,
        PEAK_SPEED * way / speed,
        PEAK_SPEED * abs(z) / vertical,
        math.sqrt(PEAK_ACCELERATION * way / acceleration),
        PEAK_SPEED * abs(turn_rad) / limits.yaw_rate_rad_s,
    )
    return longest
