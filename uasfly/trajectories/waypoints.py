"""Waypoints: a list of points, passed in flight or stopped at."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.mission import WaypointsLeg
from uasfly.trajectories.course import Course
from uasfly.trajectories.pieces import Pieces, concatenate
from uasfly.trajectories.polyline import chain, stop


def waypoints(leg: WaypointsLeg, course: Course) -> Pieces:
    """Chains of sides between the points at which the vehicle stops; the first and the last point are stops."""
    points = np.array([point.position_m for point in leg.points])
    speed = leg.speed_m_s if leg.speed_m_s is not None else course.speed_m_s
    speeds = [speed if point.speed_m_s is None else point.speed_m_s for point in leg.points[1:]]
    last = len(points) - 1
    parts = stop(points[0], leg.points[0].stop_s or 0.0)
    begin = 0
    for index, point in enumerate(leg.points[1:], start=1):
        if point.stop_s is None and index < last:
            continue
        parts.append(chain(points[begin : index + 1], speeds[begin:index], course.limits))
        asked = point.stop_s or 0.0
        parts += stop(points[index], course.stop_time_s(asked, _turn(points, index)) if index < last else asked)
        begin = index
    return concatenate(parts)


def _turn(points: Array, index: int) -> float:
    """Angle [rad] between the ways into and out of a point, seen from above; 0 where one of them is vertical."""
    way_in, way_out = points[index, :2] - points[index - 1, :2], points[index + 1, :2] - points[index, :2]
    cross = way_in[0] * way_out[1] - way_in[1] * way_out[0]
    return abs(math.atan2(float(cross), float(way_in @ way_out)))
