"""Spiral: around a point while climbing evenly along the way (Kalaitzakis 2023, section 4)."""

from __future__ import annotations

import math

import numpy as np

from uasfly.mission import SpiralLeg
from uasfly.trajectories.circle import circle_harmonics
from uasfly.trajectories.course import Course
from uasfly.trajectories.curve import curve
from uasfly.trajectories.pieces import Pieces
from uasfly.trajectories.profile import move_duration, speed_for_duration
from uasfly.trajectories.trajectory import TrajectoryError


def spiral(leg: SpiralLeg, course: Course) -> Pieces:
    """A helix from rest to rest in exactly `duration_s`, its start and stop included.

    Raises:
        TrajectoryError: the duration is too short for the leg's acceleration and jerk.
    """
    start = math.radians(leg.start_angle_deg)
    turned = leg.sense * 2.0 * math.pi * leg.turns
    climb_per_phase = (leg.height_end_m - leg.height_start_m) / turned
    scale = math.hypot(leg.radius_m, climb_per_phase)
    length = abs(turned) * scale
    speed = speed_for_duration(length, leg.duration_s, course.limits)
    if speed is None:
        shortest = move_duration(length, math.inf, course.limits)
        raise TrajectoryError(
            f"{course.field}.duration_s",
            f"{leg.duration_s:g} s is too short for {length:.1f} m with an acceleration of "
            f"{course.limits.acceleration:g} m/s^2 and a jerk of {course.limits.jerk:g} m/s^3; "
            f"give at least {shortest:.1f} s",
        )
    center = np.array((*leg.center_m, leg.height_start_m))
    harmonics = circle_harmonics(leg.radius_m)
    return curve(start, start + turned, speed, course.limits, scale, center, harmonics, climb_per_phase)
