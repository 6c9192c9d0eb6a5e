"""Line: straight from a point, or from where the vehicle is, to another."""

from __future__ import annotations

import numpy as np

from uasfly.mission import LineLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.pieces import Pieces
from uasfly.trajectories.polyline import move


def line(leg: LineLeg, course: Course) -> Pieces:
    """A move from rest to rest."""
    start = course.start if leg.from_m is None else np.array(leg.from_m)
    return move(start, np.array(leg.to_m), leg.speed_m_s, course.limits)
