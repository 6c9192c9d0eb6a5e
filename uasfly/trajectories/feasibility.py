"""What a mission asks and an airframe cannot do, found before anything flies.

Every reference, transitions included, is sampled and held against the airframe's limits. Holding a wind w means
balancing its drag D w besides what the reference accelerates: with h the horizontal and v the vertical specific force
that this takes (Kalaitzakis 2023, eq. 1), tilt is atan(h / v) and thrust sqrt(h^2 + v^2) / k_thrust.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.errors import FileError, shortened
from uasfly.files import find_file
from uasfly.messages import Array, ReferenceHorizon
from uasfly.mission import FacingYaw, Mission, WaypointsLeg
from uasfly.trajectories.mission_trajectory import MissionTrajectory, Span
from uasfly.trajectories.placement import AT_ORIGIN
from uasfly.trajectories.trajectory import TrajectoryError

SAMPLE_S = 0.02
CHUNK = 4096  # samples looked at together
COARSE_S = 0.1  # where it is looked at in flight
ASSUMED_START = np.array((3.0, 0.0, 0.0))  # in the frame of a marker, of which nobody knows yet where it is
ASSUMED_START.flags.writeable = False
ROUNDING = 1e-6
MARGIN = 0.15  # of tilt (its tangent) and thrust that should be left for gusts


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that does not fit; a mission with an error should not be flown.

    Attributes:
        severity: "error" or "warning".
        field: field of the mission file (or, from `check_airframe`, of the airframe file), dotted.
        text: what was asked, what the airframe can do, how to mend it.
    """

    severity: Literal["error", "warning"]
    field: str
    text: str


def check_mission(mission: Mission, airframe: Airframe) -> list[Finding]:
    """Everything about a mission that the airframe cannot do, errors first.

    Of a mission in a marker's frame it is assumed that its first leg begins where the take-off ends: what then is
    outside of geofence or altitudes is a warning, for the flight looks again when it has seen the marker.
    """
    findings = [*_bundle(mission), *_takeoff(mission), *_transition_speeds(mission, airframe)]
    try:
        trajectory = trajectory_from_takeoff(mission, airframe)
    except TrajectoryError as error:
        return [Finding("error", error.field, error.text), *findings]
    wind = _wind(mission, airframe)
    origin = _assumed_origin(mission, trajectory)
    worst = _Effort()
    for span in trajectory.spans:
        if mission.frame != "takeoff" and span is trajectory.spans[0] and not span.is_leg:
            continue  # where it begins is known in flight only
        peaks = _Peaks()
        for reference in _samples(trajectory, span):
            peaks.add(mission, reference, origin)
            worst.add(span, airframe, wind, reference)
        outside = _within_fence(mission, span, peaks)
        findings += map(_assuming, outside) if mission.frame == "marker" else outside
        if span.is_leg:
            findings += _within_limits(mission, airframe, span, peaks)
    findings += _headroom(mission, airframe, wind, worst)
    return sorted(findings, key=lambda finding: finding.severity != "error")


def trajectory_from_takeoff(mission: Mission, airframe: Airframe) -> MissionTrajectory:
    """The mission from where its take-off ends, before anything flies.

    Raises:
        TrajectoryError: it cannot be flown.
    """
    if mission.frame == "marker":
        return MissionTrajectory(mission, airframe.limits, ASSUMED_START, math.pi)
    return MissionTrajectory(mission, airframe.limits, np.array((0.0, 0.0, mission.takeoff.height_m)), 0.0)


def check_placed(mission: Mission, trajectory: MissionTrajectory, origin: Array) -> list[Finding]:
    """Where a whole mission leaves its geofence and altitudes, ways between legs included.

    Args:
        mission: the limits.
        trajectory: of this mission, as it lies in the world.
        origin: (3,) m, world: what the limits count from.
    """
    findings: list[Finding] = []
    for span in trajectory.spans:
        peaks = _Peaks()
        for reference in _samples(trajectory, span, COARSE_S):
            peaks.add(mission, reference, origin)
        findings += _within_fence(mission, span, peaks)
    return findings


def check_way_in(mission: Mission, trajectory: MissionTrajectory) -> list[Finding]:
    """Where the way from the trajectory's start to the first leg leaves the mission's limits.

    Args:
        mission: the limits.
        trajectory: of this mission, with the take-off point at zero: from where the vehicle really begins.
    """
    first, peaks = trajectory.spans[0], _Peaks()
    for reference in _samples(trajectory, first):
        peaks.add(mission, reference)
    return list(_within_fence(mission, first, peaks))


def check_airframe(airframe: Airframe) -> list[Finding]:
    """Whether an airframe can hold the wind that its own limits name."""
    limits, most = airframe.limits, hover_wind_limit_m_s(airframe)
    if limits.wind_m_s <= (1.0 - MARGIN) * most:
        return []
    text = (
        f"a steady {limits.wind_m_s:g} m/s is asked, and all tilt ({limits.tilt_deg:g} deg) or thrust "
        f"({limits.thrust_max:g}) holds {most:.1f} m/s; lower it to {_down((1.0 - MARGIN) * most)}, or raise "
        f"limits.tilt_deg and limits.thrust_max"
    )
    return [Finding("error" if limits.wind_m_s > most else "warning", "limits.wind_m_s", text)]


def hover_wind_limit_m_s(airframe: Airframe) -> float:
    """Steady wind [m/s] at which hovering takes all of the tilt or all of the thrust; infinite without drag."""
    limits, model = airframe.limits, airframe.model
    drag = max(model.drag_1_s[:2])
    by_tilt = GRAVITY_M_S2 * math.tan(limits.tilt_rad)
    by_thrust = math.sqrt((model.k_thrust_m_s2 * limits.thrust_max) ** 2 - GRAVITY_M_S2**2)
    return min(by_tilt, by_thrust) / drag if drag > 0.0 else math.inf


def _wind(mission: Mission, airframe: Airframe) -> float:
    return airframe.limits.wind_m_s if mission.limits.wind_m_s is None else mission.limits.wind_m_s


def _samples(trajectory: MissionTrajectory, span: Span, step_s: float = SAMPLE_S) -> Iterator[ReferenceHorizon]:
    count = max(2, math.ceil((span.end_s - span.start_s) / step_s) + 1)
    times = np.linspace(span.start_s, span.end_s, count)
    for first in range(0, count, CHUNK):
        yield trajectory.sample(times[first : first + CHUNK])


class _Peaks:
    """Largest values of a reference over a span."""

    def __init__(self) -> None:
        self.speed = self.climb = self.descent = self.acceleration = self.distance = 0.0
        self.lowest, self.highest = math.inf, -math.inf

    def add(self, mission: Mission, reference: ReferenceHorizon, origin: Array = AT_ORIGIN.origin) -> None:
        position, velocity = reference.position_in_world - origin, reference.velocity_in_world
        center = mission.limits.geofence.center_m if mission.limits.geofence else (0.0, 0.0)
        self.speed = max(self.speed, _longest(velocity))
        self.climb = max(self.climb, float(velocity[:, 2].max()))
        self.descent = max(self.descent, float(-velocity[:, 2].min()))
        self.acceleration = max(self.acceleration, _longest(reference.acceleration_in_world))
        self.distance = max(self.distance, _longest(position[:, :2] - np.array(center)))
        self.lowest = min(self.lowest, float(position[:, 2].min()))
        self.highest = max(self.highest, float(position[:, 2].max()))


class _Effort:
    """Where tilt and thrust are highest, and thrust lowest, over all spans."""

    def __init__(self) -> None:
        self.tilt, self.tilt_span, self.wind_by_tilt = 0.0, -1, math.inf
        self.thrust, self.thrust_span = 0.0, -1
        self.least, self.least_span = math.inf, -1

    def add(self, span: Span, airframe: Airframe, wind: float, reference: ReferenceHorizon) -> None:
        model = airframe.model
        drag, vertical_drag = max(model.drag_1_s[:2]), model.drag_1_s[2]
        velocity, acceleration = reference.velocity_in_world, reference.acceleration_in_world
        moving = np.linalg.norm(acceleration[:, :2] + drag * velocity[:, :2], axis=1)
        upward = GRAVITY_M_S2 + acceleration[:, 2] + vertical_drag * velocity[:, 2]
        horizontal = moving + drag * wind
        tilt = np.arctan2(horizontal, upward)
        thrust = np.hypot(horizontal, upward) / model.k_thrust_m_s2
        least = np.hypot(moving, upward) / model.k_thrust_m_s2
        if float(tilt.max()) > self.tilt:
            at = int(tilt.argmax())
            spare = math.tan(airframe.limits.tilt_rad) * (1.0 - MARGIN) * float(upward[at]) - float(moving[at])
            self.tilt, self.tilt_span = float(tilt[at]), span.leg
            self.wind_by_tilt = spare / drag if drag > 0.0 else math.inf
        if float(thrust.max()) > self.thrust:
            self.thrust, self.thrust_span = float(thrust.max()), span.leg
        if float(least.min()) < self.least:
            self.least, self.least_span = float(least.min()), span.leg


def _bundle(mission: Mission) -> Iterator[Finding]:
    if mission.marker is not None:
        try:
            find_file("bundle", mission.marker.bundle)
        except FileError as error:
            yield Finding("error", "marker.bundle", f"{shortened(mission.marker.bundle)}: {'; '.join(error.problems)}")


def _assumed_origin(mission: Mission, trajectory: MissionTrajectory) -> Array:
    """(3,) m: what the limits count from, in the frame of the trajectory."""
    if mission.frame != "marker":
        return AT_ORIGIN.origin
    first = next(span for span in trajectory.spans if span.is_leg)
    x, y, z = trajectory.position_at(first.start_s)
    return np.array((x, y, z - mission.takeoff.height_m))


def _assuming(finding: Finding) -> Finding:
    text = f"if the first leg begins where the take-off ends, {finding.text}"
    return replace(finding, severity="warning", text=text)


def _takeoff(mission: Mission) -> Iterator[Finding]:
    height, limits = mission.takeoff.height_m, mission.limits
    if mission.frame != "local" and not limits.altitude_min_m <= height <= limits.altitude_max_m:
        text = (
            f"take-off to {height:g} m ends outside limits.altitude_min_m {limits.altitude_min_m:g} to "
            f"limits.altitude_max_m {limits.altitude_max_m:g}; choose a height between them"
        )
        yield Finding("error", "takeoff.height_m", text)


def _transition_speeds(mission: Mission, airframe: Airframe) -> Iterator[Finding]:
    for name in ("speed_m_s", "acceleration_m_s2"):
        asked, limit = getattr(mission.transition, name), getattr(airframe.limits, name)
        if asked > limit:
            text = f"{asked:g} is more than limits.{name} {limit:g} of {airframe.name}; transitions keep to the latter"
            yield Finding("warning", f"transition.{name}", text)


def _within_fence(mission: Mission, span: Span, peaks: _Peaks) -> Iterator[Finding]:
    limits, what = mission.limits, _what(span)
    if limits.geofence is not None and peaks.distance > limits.geofence.radius_m + ROUNDING:
        text = (
            f"{what} reaches {peaks.distance:.2f} m from the centre of the geofence, outside its radius of "
            f"{limits.geofence.radius_m:g} m; widen it to {_up(peaks.distance)} or bring the leg in"
        )
        yield Finding("error", "limits.geofence.radius_m", text)
    if peaks.highest > limits.altitude_max_m + ROUNDING:
        text = f"{what} reaches {peaks.highest:.2f} m, above {limits.altitude_max_m:g} m; fly lower or raise it"
        yield Finding("error", "limits.altitude_max_m", text)
    if peaks.lowest < limits.altitude_min_m - ROUNDING:
        text = f"{what} comes down to {peaks.lowest:.2f} m, below {limits.altitude_min_m:g} m; fly higher or lower it"
        yield Finding("error", "limits.altitude_min_m", text)


def _within_limits(mission: Mission, airframe: Airframe, span: Span, peaks: _Peaks) -> Iterator[Finding]:
    limits, leg = airframe.limits, mission.legs[span.leg]
    for value, limit, name, what in (
        (peaks.speed, limits.speed_m_s, "speed_m_s", "a speed"),
        (peaks.climb, limits.climb_m_s, "climb_m_s", "a climb"),
        (peaks.descent, limits.descent_m_s, "descent_m_s", "a descent"),
    ):
        if value > limit * (1.0 + ROUNDING):
            field, mend = _slower(mission, span.leg, peaks.speed, limit / value)
            asked = f"{_what(span)} asks for {what} of {value:.2f} m/s"
            text = f"{asked}; limits.{name} of {airframe.name} is {limit:g}; {mend}"
            yield Finding("error", field, text)
    if peaks.acceleration > limits.acceleration_m_s2 * (1.0 + ROUNDING):
        yield _too_quick(mission, airframe, span, peaks)
    rate = span.asked_yaw_rate_rad_s
    if rate > limits.yaw_rate_rad_s * (1.0 + 1e-3):
        facing = isinstance(mission.yaw_rule(span.leg), FacingYaw)
        mend = "keep the point farther from the way" if facing else "stop at sharp corners (stop_s)"
        text = (
            f"{_what(span)} asks for a yaw rate of {math.degrees(rate):.0f} deg/s; limits.yaw_rate_deg_s of "
            f"{airframe.name} is {limits.yaw_rate_deg_s:g}; {mend}, fly slower, or use another yaw rule"
        )
        yield Finding("error", f"legs[{span.leg}].yaw" if leg.yaw else "yaw", text)


def _too_quick(mission: Mission, airframe: Airframe, span: Span, peaks: _Peaks) -> Finding:
    limit, leg = airframe.limits.acceleration_m_s2, mission.legs[span.leg]
    own = getattr(leg, "acceleration_m_s2", None)
    along_way = own if own is not None else mission.transition.acceleration_m_s2
    if along_way > limit:
        field = f"legs[{span.leg}].acceleration_m_s2" if own is not None else "transition.acceleration_m_s2"
        mend = f"lower {field} to {limit:g}"
    else:  # the curve's own acceleration goes with the square of the speed
        field, mend = _slower(mission, span.leg, peaks.speed, math.sqrt(limit / peaks.acceleration))
        mend += " or fly a wider curve"
    text = (
        f"{_what(span)} asks for an acceleration of {peaks.acceleration:.2f} m/s^2; limits.acceleration_m_s2 of "
        f"{airframe.name} is {limit:g}; {mend}"
    )
    return Finding("error", field, text)


def _headroom(mission: Mission, airframe: Airframe, wind: float, worst: _Effort) -> Iterator[Finding]:
    limits, name = airframe.limits, airframe.name
    if mission.limits.wind_m_s is not None and wind > limits.wind_m_s:
        text = (
            f"{wind:g} m/s is more than the {limits.wind_m_s:g} m/s that the limits of {name} are sized for; lower it"
        )
        yield Finding("warning", "limits.wind_m_s", text)
    share = math.tan(worst.tilt) / math.tan(limits.tilt_rad) if worst.tilt < 0.5 * math.pi else math.inf
    if share > 1.0 - MARGIN:
        helps = 0.1 < worst.wind_by_tilt < math.inf  # without drag less wind helps nothing
        possible = f"lower limits.wind_m_s to {_down(worst.wind_by_tilt)}, " if helps else ""
        text = (
            f"legs[{worst.tilt_span}] in {wind:g} m/s of wind takes {math.degrees(worst.tilt):.1f} deg of tilt; "
            f"{name} may tilt {limits.tilt_deg:g} deg and should keep {MARGIN:.0%} for gusts; "
            f"{possible}accelerate less, or raise limits.tilt_deg"
        )
        yield Finding("error" if share > 1.0 else "warning", "limits.wind_m_s", text)
    if worst.thrust > (1.0 - MARGIN) * limits.thrust_max:
        text = (
            f"legs[{worst.thrust_span}] in {wind:g} m/s of wind takes a thrust of {worst.thrust:.2f}; {name} may use "
            f"{limits.thrust_max:g} and should keep {MARGIN:.0%} for gusts; lower limits.wind_m_s or accelerate less"
        )
        yield Finding("error" if worst.thrust > limits.thrust_max else "warning", "limits.wind_m_s", text)
    if worst.least < limits.thrust_min:
        text = (
            f"it falls so fast that thrust drops to {worst.least:.2f}; limits.thrust_min of {name} is "
            f"{limits.thrust_min:g}; lower acceleration_m_s2"
        )
        yield Finding("error", f"legs[{worst.least_span}]", text)


def _slower(mission: Mission, index: int, reached: float, factor: float) -> tuple[str, str]:
    """The field that sets a leg's speed, and what it must be for the speed reached to be multiplied by `factor`."""
    leg = mission.legs[index]
    if isinstance(leg, WaypointsLeg):
        return f"legs[{index}]", f"multiply its speeds by {_down(factor)}"
    for name in ("speed_m_s", "period_s", "duration_s"):
        value = getattr(leg, name, None)
        if value is not None:
            speed = name == "speed_m_s"
            lower = f"lower {name} to {_down(min(value, reached) * factor)}"
            return f"legs[{index}].{name}", lower if speed else f"raise {name} to {_up(value / factor)}"
    raise AssertionError(f"no field sets the speed of {leg.type}")


def _what(span: Span) -> str:
    return f"legs[{span.leg}] ({span.name})" if span.is_leg else f"the way to legs[{span.leg}] ({span.name})"


def _longest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _down(value: float) -> str:
    """Two figures, rounded towards zero, so that the advice is safe."""
    step = _step(value)
    return f"{math.floor(value / step) * step:g}"


def _up(value: float) -> str:
    """Two figures, rounded up, so that the advice is safe."""
    step = _step(value)
    return f"{math.ceil(value / step) * step:g}"


def _step(value: float) -> float:
    return float(10.0 ** (math.floor(math.log10(value)) - 1))
