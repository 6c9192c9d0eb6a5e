"""Back and forth: a straight track flown to and fro with stops at both ends (Kalaitzakis 2023, section 4)."""

from __future__ import annotations

import math

import numpy as np

from uasfly.mission import BackAndForthLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.pieces import Pieces, concatenate
from uasfly.trajectories.polyline import move, stop
from uasfly.trajectories.profile import move_duration
from uasfly.trajectories.trajectory import TrajectoryError

MAX_PASSES = 1000


def back_and_forth(leg: BackAndForthLeg, course: Course) -> Pieces:
    """Stop, pass, stop, pass, ..., stop: as many passes as asked, or as fit the duration.

    Raises:
        TrajectoryError: not one pass fits the duration, or more than a thousand do.
    """
    start, end = np.array(leg.start_m), np.array(leg.end_m)
    stop_s = course.stop_time_s(leg.stop_s, math.pi)
    pass_s = move_duration(math.dist(leg.start_m, leg.end_m), leg.speed_m_s, course.limits)
    passes = leg.passes
    if passes is None:
        duration_s = leg.duration_s or 0.0
        passes = int((duration_s - stop_s) / (pass_s + stop_s) + 1e-9)
        if passes < 1:
            raise TrajectoryError(
                f"{course.field}.duration_s",
                f"{duration_s:g} s is too short for one pass: {pass_s:.2f} s and a stop of {stop_s:.2f} s at both ends "
                f"take {pass_s + 2.0 * stop_s:.2f} s; give at least that, or shorten stop_s",
            )
        if passes > MAX_PASSES:
            raise TrajectoryError(
                f"{course.field}.duration_s",
                f"{duration_s:g} s hold {passes} passes of {pass_s:.3f} s; expected at most {MAX_PASSES}",
            )
    parts = stop(start, stop_s)
    for number in range(passes):
        origin, target = (start, end) if number % 2 == 0 else (end, start)
        parts += [move(origin, target, leg.speed_m_s, course.limits), *stop(target, stop_s)]
    return concatenate(parts)
