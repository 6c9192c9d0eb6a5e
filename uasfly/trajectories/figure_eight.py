"""Figure eight: the curve (sin phase, sin of twice the phase), crossing itself at its centre (lemniscate of Gerono)."""

from __future__ import annotations

import math

import numpy as np

from uasfly.mission import FigureEightLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.curve import curve
from uasfly.trajectories.pieces import Pieces


def figure_eight(leg: FigureEightLeg, course: Course) -> Pieces:
    """Eights from rest to rest at the centre; speed and acceleration limit hold at the crossing, the fastest place."""
    heading = math.radians(leg.heading_deg)
    harmonics = np.zeros((4, 3))
    harmonics[1, :2] = 0.5 * leg.length_m * np.array((math.cos(heading), math.sin(heading)))
    harmonics[3, :2] = 0.5 * leg.width_m * np.array((-math.sin(heading), math.cos(heading)))
    scale = math.hypot(0.5 * leg.length_m, leg.width_m)  # |dp/dphase| at the crossing
    speed = leg.speed_m_s if leg.speed_m_s is not None else 2.0 * math.pi * scale / (leg.period_s or math.inf)
    center = np.array((*leg.center_m, leg.height_m))
    return curve(0.0, 2.0 * math.pi * leg.turns, speed, course.limits, scale, center, harmonics)
