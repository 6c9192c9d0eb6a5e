"""A mission as one reference: transition, leg, transition, leg, ..., all from rest to rest."""

from __future__ import annotations

import copy
import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from uasfly.airframe import Limits
from uasfly.messages import Array, ReferenceHorizon
from uasfly.mission import (
    BackAndForthLeg,
    CircleLeg,
    FigureEightLeg,
    HoverLeg,
    Leg,
    LineLeg,
    Mission,
    MovingLeg,
    PathYaw,
    SpiralLeg,
    WaypointsLeg,
)
from uasfly.trajectories import yaw as yaw_motion
from uasfly.trajectories.back_and_forth import back_and_forth
from uasfly.trajectories.circle import circle
from uasfly.trajectories.course import Course
from uasfly.trajectories.figure_eight import figure_eight
from uasfly.trajectories.hover import hover
from uasfly.trajectories.line import line
from uasfly.trajectories.pieces import Pieces, PieceTable, concatenate, rest
from uasfly.trajectories.placement import AT_ORIGIN, Placement
from uasfly.trajectories.polyline import move
from uasfly.trajectories.profile import MotionLimits
from uasfly.trajectories.spiral import spiral
from uasfly.trajectories.trajectory import TrajectoryError
from uasfly.trajectories.waypoints import waypoints

LONGEST_S = 7200.0
SAME_YAW_RAD = 1e-9


@dataclass(frozen=True, slots=True)
class Span:
    """A leg, or the transition that leads to it.

    Attributes:
        leg: index of the leg. is_leg: False for the transition to it. name: the leg's, or its type.
        start_s, end_s: from the start of the trajectory.
        asked_yaw_rate_rad_s: highest yaw rate that the leg's rule asks for, before it was bounded.
    """

    leg: int
    is_leg: bool
    name: str
    start_s: float
    end_s: float
    asked_yaw_rate_rad_s: float = 0.0


class MissionTrajectory:
    """Reference of a whole mission.

    Transitions keep the mission's transition speed and acceleration and the airframe's limits, whichever are lower, and
    last long enough to turn; legs are flown as the file says (`check_mission` tells what is too much). The yaw rate
    never exceeds the airframe's limit.

    Args:
        mission: the mission.
        airframe_limits: speeds, acceleration and yaw rate.
        start_position: (3,) m, world, where the first transition begins, at rest.
        start_yaw: [rad], world.
        placement: where the mission's frame lies; not asked in the frame `local`, which is the world.

    Raises:
        TrajectoryError: a leg cannot be flown in the time it gives, or the mission takes more than two hours.
    """

    def __init__(
        self,
        mission: Mission,
        airframe_limits: Limits,
        start_position: Array,
        start_yaw: float,
        placement: Placement | None = None,
    ) -> None:
        self.mission = mission
        self._placement = placement = AT_ORIGIN if placement is None or mission.frame == "local" else placement
        parts: list[Pieces] = []
        yaws: list[yaw_motion.YawKnots] = []
        spans: list[Span] = []
        position = placement.from_world(np.asarray(start_position, dtype=float))
        heading, time = float(start_yaw) - placement.heading_rad, 0.0
        for index, leg in enumerate(mission.legs):
            pieces = _leg_pieces(mission, index, airframe_limits, position)
            if not pieces.duration_s <= LONGEST_S - time:
                field = f"legs[{index}]"
                raise TrajectoryError(field, f"it ends {time + pieces.duration_s:.0f} s after the start; {_TOO_LONG}")
            table = PieceTable(pieces)
            begin, end = table.sample(np.array((0.0, table.duration_s)))[0]
            knots = yaw_motion.along(mission.yaw_rule(index), table, heading, airframe_limits.yaw_rate_rad_s)
            first_yaw = float(knots.yaw_rad[0])

            transition = _transition(mission, airframe_limits, position, begin, first_yaw - heading)
            if transition.duration_s > LONGEST_S - time - pieces.duration_s:
                text = f"the way to it takes {transition.duration_s:.0f} s; {_TOO_LONG}"
                raise TrajectoryError(f"legs[{index}]", text)
            name = leg.name or leg.type
            if transition.duration_s > 0.0:
                parts.append(transition)
                yaws.append(yaw_motion.turn(heading, first_yaw, transition.duration_s))
                spans.append(Span(index, False, name, time, time + transition.duration_s))
                time = spans[-1].end_s
            parts.append(pieces)
            yaws.append(knots)
            spans.append(Span(index, True, name, time, time + table.duration_s, knots.asked_rate_rad_s))
            position, heading, time = end, float(knots.yaw_rad[-1]), spans[-1].end_s
        self.spans: tuple[Span, ...] = tuple(spans)
        self._starts = [span.start_s for span in spans]
        self._pieces = concatenate(parts)
        self._table = PieceTable(self._pieces, placement)
        self._yaw = yaw_motion.YawTable(yaws, placement.heading_rad)

    @property
    def duration_s(self) -> float:
        """Time from start to end [s]."""
        return self._table.duration_s

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """Reference at (n,) times [s]; before 0 and after `duration_s` it holds its first and last pose."""
        position, velocity, acceleration = self._table.sample(times_s)
        yaw, yaw_rate = self._yaw.sample(times_s)
        return ReferenceHorizon(times_s, position, velocity, acceleration, yaw, yaw_rate)

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Position [m] of the reference at one time [s], without arrays."""
        return self._table.position_at(time_s)

    def span_at(self, time_s: float) -> Span:
        """The leg or transition at a time; the first before the start, the last after the end."""
        return self.spans[max(bisect_right(self._starts, time_s) - 1, 0)]

    def leg_at(self, time_s: float) -> int:
        """Index of the leg at a time; in a transition, of the leg it leads to."""
        return self.span_at(time_s).leg

    def in_leg(self, time_s: float) -> bool:
        """Whether a leg flies at a time: not in transitions, not before the start, not after the end."""
        return 0.0 <= time_s <= self.duration_s and self.span_at(time_s).is_leg

    def reanchored(self, placement: Placement) -> MissionTrajectory:
        """The same trajectory with the mission's frame elsewhere; the frame `local` lies where it lies."""
        moved = copy.copy(self)
        if self.mission.frame != "local":
            moved._placement = placement
            moved._table = PieceTable(self._pieces, placement)
            moved._yaw = self._yaw.turned(placement.heading_rad)
        return moved


_TOO_LONG = f"expected a mission of at most {LONGEST_S:.0f} s; shorten it or fly faster"


def _build(leg: Leg, course: Course) -> Pieces:
    """Motion of one leg."""
    match leg:
        case HoverLeg():
            return hover(leg, course)
        case BackAndForthLeg():
            return back_and_forth(leg, course)
        case SpiralLeg():
            return spiral(leg, course)
        case CircleLeg():
            return circle(leg, course)
        case FigureEightLeg():
            return figure_eight(leg, course)
        case LineLeg():
            return line(leg, course)
        case WaypointsLeg():
            return waypoints(leg, course)


def _leg_pieces(mission: Mission, index: int, airframe_limits: Limits, position: Array) -> Pieces:
    leg = mission.legs[index]
    acceleration, jerk = mission.transition.acceleration_m_s2, mission.transition.jerk_m_s3
    if isinstance(leg, MovingLeg):
        acceleration = leg.acceleration_m_s2 or acceleration
        jerk = leg.jerk_m_s3 or jerk
    follows_path = isinstance(mission.yaw_rule(index), PathYaw)
    turn_time = partial(yaw_motion.turn_time_s, rate_rad_s=airframe_limits.yaw_rate_rad_s)
    course = Course(
        field=f"legs[{index}]",
        limits=MotionLimits(acceleration, jerk),
        speed_m_s=mission.transition.speed_m_s,
        start=position,
        turn_time_s=turn_time if follows_path else None,
    )
    pieces = _build(leg, course)
    # A line to where the vehicle already is takes no time; it stays a leg nevertheless.
    return pieces if pieces.duration_s > 0.0 else rest(position, yaw_motion.KNOT_INTERVAL_S)


def _transition(mission: Mission, limits: Limits, start: Array, end: Array, turned_rad: float) -> Pieces:
    """Straight from rest to rest, then rest until the turn is done."""
    asked = mission.transition
    way = end - start
    distance = float(np.linalg.norm(way))
    speed, acceleration = asked.speed_m_s, min(asked.acceleration_m_s2, limits.acceleration_m_s2)
    if distance > 0.0:
        climb = float(way[2]) / distance
        speed = min(speed, limits.speed_m_s, _vertical_limit(climb, limits))
    moved = move(start, end, speed, MotionLimits(acceleration, asked.jerk_m_s3))
    turning = abs(turned_rad)
    turn_s = yaw_motion.turn_time_s(turning, limits.yaw_rate_rad_s) if turning > SAME_YAW_RAD else 0.0
    parts: Sequence[Pieces] = (moved, rest(end, max(0.0, turn_s - moved.duration_s)))
    return concatenate(parts)


def _vertical_limit(climb: float, limits: Limits) -> float:
    """Highest speed [m/s] along a way, `climb` being the sine of its angle, at which the vertical speed is allowed."""
    if climb == 0.0:
        return math.inf
    return (limits.climb_m_s if climb > 0.0 else limits.descent_m_s) / abs(climb)
