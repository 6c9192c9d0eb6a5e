"""Jerk-limited changes of velocity (S-curves) and the speeds that fit a distance or a duration.

A change of velocity by `delta` takes three phases: the acceleration grows at the largest jerk, stays at its limit, and
falls again; a small change never reaches the limit and has two. The velocity is point-symmetric about the middle, so on
average it is the mean of both ends. A move from rest to rest is such a change up, a cruise and one down: at most seven
phases (Biagiotti & Melchiorri 2008, Trajectory Planning for Automatic Machines and Robots, section 3.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Largest acceleration [m/s^2] and jerk [m/s^3] of a motion."""

    acceleration: float
    jerk: float

    def scaled(self, factor: float) -> MotionLimits:
        """The same limits in other units of length."""
        return MotionLimits(self.acceleration * factor, self.jerk * factor)


def ramp_phases(delta: float, limits: MotionLimits) -> tuple[float, float]:
    """Durations [s] of the growing (and of the falling) phase and of the phase at constant acceleration.

    Args:
        delta: magnitude of the change of velocity [m/s].
        limits: acceleration and jerk.
    """
    if delta * limits.jerk <= limits.acceleration**2:
        return math.sqrt(delta / limits.jerk), 0.0
    growing = limits.acceleration / limits.jerk
    return growing, delta / limits.acceleration - growing


def ramp_duration(delta: float, limits: MotionLimits) -> float:
    """Duration [s] of a change of velocity by `delta` [m/s]."""
    growing, constant = ramp_phases(delta, limits)
    return 2.0 * growing + constant


def peak_speed(distance: float, limits: MotionLimits) -> float:
    """Highest speed [m/s] of the fastest move from rest to rest over `distance` [m] when nothing else limits the speed.

    It is the speed v at which both ramps together cover the distance: distance = v * ramp_duration(v).
    """
    acceleration, jerk = limits.acceleration, limits.jerk
    speed = math.pow(distance * math.sqrt(jerk) / 2.0, 2.0 / 3.0)
    if speed * jerk <= acceleration**2:
        return speed
    lag = acceleration**2 / jerk  # v^2 + lag v = acceleration * distance, solved without cancellation
    root = math.sqrt(lag**2 + 4.0 * acceleration * distance)
    return 2.0 * acceleration * distance / (lag + root)


def move_duration(distance: float, speed: float, limits: MotionLimits) -> float:
    """Shortest time [s] from rest to rest over `distance` [m] at no more than `speed` [m/s]."""
    if distance <= 0.0:
        return 0.0
    cruise = min(speed, peak_speed(distance, limits))
    return distance / cruise + ramp_duration(cruise, limits)


def speed_for_duration(distance: float, duration: float, limits: MotionLimits) -> float | None:
    """Cruise speed [m/s] with which a move from rest to rest over `distance` [m] takes exactly `duration` [s].

    Returns:
        The speed, or None when even the fastest move takes longer.
    """
    high = peak_speed(distance, limits)
    if distance / high + ramp_duration(high, limits) > duration * (1.0 + 1e-12):
        return None
    low = min(distance / duration, high)  # without ramps it would take this; the duration falls with the speed
    for _ in range(200):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if distance / middle + ramp_duration(middle, limits) > duration:
            low = middle
        else:
            high = middle
    return high
