"""Circle: around a point at one height, starting and stopping smoothly on the circle."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.mission import CircleLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.curve import curve
from uasfly.trajectories.pieces import Pieces


def circle(leg: CircleLeg, course: Course) -> Pieces:
    """Turn by `turns` at cruise speed; the period, when given, is that of a turn at cruise speed."""
    speed = leg.speed_m_s if leg.speed_m_s is not None else 2.0 * math.pi * leg.radius_m / (leg.period_s or math.inf)
    start = math.radians(leg.start_angle_deg)
    end = start + leg.sense * 2.0 * math.pi * leg.turns
    center = np.array((*leg.center_m, leg.height_m))
    return curve(start, end, speed, course.limits, leg.radius_m, center, circle_harmonics(leg.radius_m))


def circle_harmonics(radius_m: float) -> Array:
    """Harmonics (4, 3) [m] of a level circle: radius * (cos, sin, 0)."""
    harmonics = np.zeros((4, 3))
    harmonics[0, 0] = harmonics[1, 1] = radius_m
    return harmonics
