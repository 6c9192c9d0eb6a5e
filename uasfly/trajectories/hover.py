"""Hover: stay at a point."""

from __future__ import annotations

import numpy as np

from uasfly.mission import HoverLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.pieces import Pieces, rest


def hover(leg: HoverLeg, _course: Course) -> Pieces:
    """Rest at the leg's position for its duration."""
    return rest(np.array(leg.position_m), leg.duration_s)
