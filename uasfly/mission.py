"""Mission files: where to fly, how fast, within which limits, and what to do at the end.

Points are [x, y, z] in metres along east, north and up from the ground at the take-off point (frame `takeoff`) or from
PX4's local origin (frame `local`). In the frame `marker` they count from the bundle's origin: x is the horizontal
direction out of the page towards the viewer, z is up however the page leans, and y is to the left of x (of a board on
a wall: to its viewer's right). A page within 45 deg of lying flat (on the floor, under a deck) has no such direction:
there x is where its upper edge points. So [4.2, 0, 0.2] is 4.2 m in front of a board and 0.2 m above its centre, and
`yaw: {rule: facing, point_m: [0, 0]}` looks at it. Yaw 0 is along x. Angles are degrees in the file, because people
write it, and radians behind.

Geofence and altitudes count from the take-off point in the frame `marker` too: they are about the ground and whoever
stands on it, not about the bundle.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from uasfly.airframe import FileModel
from uasfly.marker_settings import MarkerSettings
from uasfly.monitor_settings import MonitorSettings

LEAST = 1e-4  # of metres, seconds, turns, m/s: what is less is a slip, and its reciprocal nothing to fly by
Coordinate = Annotated[float, Field(ge=-10_000.0, le=10_000.0, allow_inf_nan=False)]
Point = tuple[Coordinate, Coordinate, Coordinate]
GroundPoint = tuple[Coordinate, Coordinate]
Length = Annotated[float, Field(gt=LEAST, le=10_000.0, allow_inf_nan=False)]
Duration = Annotated[float, Field(gt=LEAST, le=7200.0, allow_inf_nan=False)]
Pause = Annotated[float, Field(ge=0.0, le=7200.0, allow_inf_nan=False)]
Speed = Annotated[float, Field(gt=LEAST, le=50.0, allow_inf_nan=False)]
Acceleration = Annotated[float, Field(gt=LEAST, le=50.0, allow_inf_nan=False)]
Jerk = Annotated[float, Field(gt=LEAST, le=1000.0, allow_inf_nan=False)]
Wind = Annotated[float, Field(gt=0.0, le=40.0, allow_inf_nan=False)]
Turns = Annotated[float, Field(gt=LEAST, le=1000.0, allow_inf_nan=False)]
Angle = Annotated[float, Field(ge=-720.0, le=720.0, allow_inf_nan=False)]
Direction = Literal["counterclockwise", "clockwise"]


class FixedYaw(FileModel):
    """The nose points one way: 0 is east, 90 is north."""

    rule: Literal["fixed"] = "fixed"
    yaw_deg: Annotated[Angle, Field(description="0 is east, counter-clockwise positive (90 is north)")]

    @property
    def yaw_rad(self) -> float:
        """The heading [rad]."""
        return math.radians(self.yaw_deg)


class PathYaw(FileModel):
    """The nose points along the path; at stops it turns to where the path goes on."""

    rule: Literal["path"]


class FacingYaw(FileModel):
    """The nose points at a vertical line through a point."""

    rule: Literal["facing"]
    point_m: GroundPoint


YawRule = Annotated[FixedYaw | PathYaw | FacingYaw, Field(discriminator="rule")]


class LegBase(FileModel):
    """What every leg may say."""

    name: str = ""
    yaw: Annotated[YawRule | None, Field(description="the mission's rule when not given")] = None


class MovingLeg(LegBase):
    """A leg that starts and stops: its own acceleration and jerk, or the transition's when not given."""

    acceleration_m_s2: Acceleration | None = None
    jerk_m_s3: Jerk | None = None


class HoverLeg(LegBase):
    """Stay at a point."""

    type: Literal["hover"]
    position_m: Point
    duration_s: Duration


class BackAndForthLeg(MovingLeg):
    """Fly a straight track to and fro, stopping at both ends; it begins and ends with a stop."""

    type: Literal["back_and_forth"]
    start_m: Point
    end_m: Point
    speed_m_s: Annotated[Speed, Field(description="cruise speed")]
    stop_s: Annotated[Pause, Field(description="stop at each end")] = 0.0
    passes: Annotated[int, Field(ge=1, le=1000, description="number of times the track is flown")] | None = None
    duration_s: Annotated[Duration | None, Field(description="as many passes as fit into it")] = None

    @model_validator(mode="after")
    def _passes_or_duration(self) -> BackAndForthLeg:
        _one_of("passes", self.passes, "duration_s", self.duration_s)
        _differ("start_m", self.start_m, "end_m", self.end_m)
        return self


class CurveLeg(MovingLeg):
    """A leg around a centre."""

    center_m: GroundPoint
    turns: Turns = 1.0
    direction: Direction = "counterclockwise"
    start_angle_deg: Annotated[Angle, Field(description="where it starts, seen from the centre; 0 is east")] = 0.0

    @property
    def sense(self) -> float:
        """+1 counter-clockwise, -1 clockwise."""
        return 1.0 if self.direction == "counterclockwise" else -1.0


class CircleLeg(CurveLeg):
    """Fly around a point at one height."""

    type: Literal["circle"]
    radius_m: Length
    height_m: Coordinate
    speed_m_s: Speed | None = None
    period_s: Annotated[Duration | None, Field(description="time of one turn at cruise speed")] = None

    @model_validator(mode="after")
    def _speed_or_period(self) -> CircleLeg:
        _one_of("speed_m_s", self.speed_m_s, "period_s", self.period_s)
        return self


class SpiralLeg(CurveLeg):
    """Fly around a point while climbing or descending evenly."""

    type: Literal["spiral"]
    radius_m: Length
    height_start_m: Coordinate
    height_end_m: Coordinate
    duration_s: Duration


class FigureEightLeg(MovingLeg):
    """Fly an eight through its centre, first towards the heading's left half of the far lobe."""

    type: Literal["figure_eight"]
    center_m: GroundPoint
    height_m: Coordinate
    length_m: Annotated[Length, Field(description="from tip to tip")]
    width_m: Annotated[Length, Field(description="of a lobe, across the length")]
    heading_deg: Annotated[Angle, Field(description="direction of the length; 0 is east")] = 0.0
    turns: Turns = 1.0
    speed_m_s: Annotated[Speed | None, Field(description="highest speed, reached at the crossing")] = None
    period_s: Annotated[Duration | None, Field(description="time of one eight at cruise")] = None

    @model_validator(mode="after")
    def _speed_or_period(self) -> FigureEightLeg:
        _one_of("speed_m_s", self.speed_m_s, "period_s", self.period_s)
        return self


class LineLeg(MovingLeg):
    """Fly straight from a point, or from where the leg before it ends, to another."""

    type: Literal["line"]
    from_m: Annotated[Point | None, Field(description="where the leg before it ends, when not given")] = None
    to_m: Point
    speed_m_s: Speed


class Waypoint(FileModel):
    """A point of a list; without `stop_s` it is passed in flight, the corner rounded within the acceleration limit."""

    position_m: Point
    speed_m_s: Annotated[Speed | None, Field(description="on the way to this point; the leg's when not given")] = None
    stop_s: Annotated[Pause | None, Field(description="come to rest here for so long")] = None


class WaypointsLeg(MovingLeg):
    """Fly a list of points, starting at rest at the first and ending at rest at the last."""

    type: Literal["waypoints"]
    points: Annotated[tuple[Waypoint, ...], Field(min_length=2, max_length=1000)]
    speed_m_s: Annotated[Speed | None, Field(description="the transition's when not given")] = None


Leg = Annotated[
    HoverLeg | BackAndForthLeg | SpiralLeg | CircleLeg | FigureEightLeg | LineLeg | WaypointsLeg,
    Field(discriminator="type"),
]


class Takeoff(FileModel):
    """The vehicle's own take-off."""

    height_m: Annotated[float, Field(gt=0.0, le=100.0, description="above the ground at the take-off point")]


class Transition(FileModel):
    """How the vehicle moves from the end of one leg to the start of the next."""

    speed_m_s: Speed = 0.5
    acceleration_m_s2: Acceleration = 0.5
    jerk_m_s3: Jerk = 1.0


class Ending(FileModel):
    """What happens after the last leg."""

    action: Literal["land", "hold", "return"] = "land"


class Geofence(FileModel):
    """A vertical cylinder that the reference never leaves."""

    radius_m: Length
    center_m: Annotated[
        GroundPoint, Field(description="in the mission's frame; from the take-off point in the frame marker")
    ] = (0.0, 0.0)


class MissionLimits(FileModel):
    """Where and in which wind the mission may be flown."""

    geofence: Geofence | None = None
    altitude_min_m: Annotated[
        Coordinate,
        Field(
            description="lowest height of the legs, in the mission's frame; over the take-off point in the frame marker"
        ),
    ] = 0.3
    altitude_max_m: Annotated[Coordinate, Field(description="greatest height of the legs")] = 120.0
    wind_m_s: Annotated[
        Wind | None, Field(description="steady wind it may be flown in; the airframe's limit when not given")
    ] = None

    @model_validator(mode="after")
    def _altitudes_in_order(self) -> MissionLimits:
        if not self.altitude_min_m < self.altitude_max_m:
            raise ValueError(
                f"altitude_min_m must be below altitude_max_m, found {self.altitude_min_m} and {self.altitude_max_m}"
            )
        return self


class Mission(FileModel):
    """One flight: take-off, legs joined by smooth transitions, ending."""

    name: Annotated[str, Field(min_length=1)]
    description: str = ""
    frame: Annotated[
        Literal["takeoff", "local", "marker"],
        Field(
            description="origin of the points: the ground at the take-off point, PX4's local origin, or a bundle of "
            "markers (x out of its page, z up; see the section marker)"
        ),
    ] = "takeoff"
    marker: Annotated[MarkerSettings | None, Field(description="the bundle of the frame marker")] = None
    takeoff: Takeoff
    legs: Annotated[tuple[Leg, ...], Field(min_length=1, max_length=200)]
    transition: Transition = Transition()
    yaw: YawRule = FixedYaw(yaw_deg=0.0)
    ending: Ending = Ending()
    limits: MissionLimits = MissionLimits()
    monitors: MonitorSettings = MonitorSettings()

    @model_validator(mode="after")
    def _marker_and_its_frame(self) -> Mission:
        if self.frame == "marker" and self.marker is None:
            raise ValueError("frame: marker needs the bundle it hangs on, for example marker: {bundle: four_36h11}")
        if self.frame != "marker" and self.marker is not None:
            raise ValueError(
                f"marker: belongs to frame: marker, found frame: {self.frame}; leave it out or change frame"
            )
        return self

    def yaw_rule(self, leg: int) -> FixedYaw | PathYaw | FacingYaw:
        """The yaw rule of a leg: its own or the mission's."""
        return self.legs[leg].yaw or self.yaw


def _one_of(first: str, first_value: float | None, second: str, second_value: float | None) -> None:
    if (first_value is None) == (second_value is None):
        state = "both are given" if first_value is not None else "neither is given"
        raise ValueError(f"expected either {first} or {second}, but {state}")


def _differ(first: str, first_value: Point, second: str, second_value: Point) -> None:
    if math.dist(first_value, second_value) < 1e-3:
        raise ValueError(f"{first} and {second} must be apart, found both at {list(first_value)}")
