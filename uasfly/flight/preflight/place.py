"""Home, geofence and the way to the first leg, from where the vehicle is."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from uasfly.flight.course import TOO_FAR_M
from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.frames import euler_from_quaternion
from uasfly.messages import Array
from uasfly.monitor_settings import Monitor
from uasfly.preflight_messages import PreflightCheck
from uasfly.trajectories.feasibility import check_way_in, trajectory_from_takeoff
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.trajectory import TrajectoryError

HOME_FAR_M = 10.0  # more than GNSS wanders while a vehicle waits: it was carried

_HOME = Subject("home", "PX4 returns there, by itself too when it loses a link")
_FENCE = Subject("geofence", "outside of it the flight ends as soon as it has begun")
_FIRST = Subject("first waypoint", "the mission begins with a straight way from the take-off to its first leg")


def plan_from_here(gathered: Gathered) -> MissionTrajectory | str | None:
    """The mission from where it would begin, in its own frame; a text where it cannot be flown, None without a place.

    On the ground it begins at the height of the take-off. Where a marker is, is not known yet: see `check_mission`.
    """
    place = _place(gathered)
    if place is None or gathered.estimate is None:
        return None
    if gathered.mission.frame == "marker":
        try:
            return trajectory_from_takeoff(gathered.mission, gathered.airframe)
        except TrajectoryError as error:
            return f"{error.field}: {error.text}"
    start = place if gathered.view.in_air else place + np.array((0.0, 0.0, gathered.mission.takeoff.height_m))
    _, _, yaw = euler_from_quaternion(gathered.estimate.quaternion_body_to_world)
    try:
        return MissionTrajectory(gathered.mission, gathered.airframe.limits, start, yaw)
    except TrajectoryError as error:
        return f"{error.field}: {error.text}"


def place_checks(gathered: Gathered, plan: MissionTrajectory | str | None) -> Iterator[PreflightCheck]:
    """All checks of this file; `plan` is the answer of `plan_from_here`."""
    yield _home(gathered)
    yield _fence(gathered)
    yield _first_waypoint(gathered, plan)


def may_return(gathered: Gathered) -> bool:
    """Whether the mission itself asks PX4 to return, at its end or when a monitor finds something."""
    monitors = (value for _, value in gathered.mission.monitors if isinstance(value, Monitor))
    actions = {action for monitor in monitors for action in (monitor.action, monitor.then)}
    return gathered.mission.ending.action == "return" or "return" in actions


def _place(gathered: Gathered) -> Array | None:
    """Where the vehicle is, in the mission's frame."""
    if gathered.estimate is None or gathered.origin is None:
        return None
    place = gathered.estimate.position_in_world - gathered.origin
    return place if math.isfinite(float(place.sum())) else None


def _home(gathered: Gathered) -> PreflightCheck:
    home = None if gathered.facts is None else gathered.facts.home
    if home is None:
        remedy = "wait for GNSS until PX4 sets home, or set it in a ground station"
        if gathered.mission.ending.action == "return":
            return _HOME.stop("none, and the mission ends with a return", remedy)
        return _HOME.warning("none, or not told", remedy)
    if gathered.estimate is None:
        return _HOME.warning("set, its distance is not known", "see that it is where the vehicle may land")
    east, north, _ = (gathered.estimate.position_in_world - home).tolist()
    distance = math.hypot(east, north)
    value = f"{distance:.1f} m away"
    if distance > HOME_FAR_M and not gathered.view.in_air:
        return _HOME.warning(value, "the vehicle stands elsewhere: restart PX4, or set home in a ground station")
    return _HOME.ok(value)


def _fence(gathered: Gathered) -> PreflightCheck:
    fence, place = gathered.mission.limits.geofence, _place(gathered)
    if fence is None:
        return _FENCE.warning("none", "set limits.geofence in the mission file")
    if place is None:
        return _FENCE.warning("position not known", "wait for the estimate")
    distance = math.dist(place[:2].tolist(), fence.center_m)
    value = f"{distance:.1f} m from its centre, radius {fence.radius_m:g} m"
    if distance > fence.radius_m:
        return _FENCE.stop(value, "bring the vehicle inside, or move or widen limits.geofence")
    return _FENCE.ok(value)


def _first_waypoint(gathered: Gathered, plan: MissionTrajectory | str | None) -> PreflightCheck:
    if plan is None:
        return _FIRST.warning("position not known", "wait for the estimate")
    if isinstance(plan, str):
        return _FIRST.stop("cannot be flown from here", plan)
    if gathered.mission.frame == "marker":
        return _FIRST.ok("hangs on the marker: limits are checked when it has been seen")
    span = plan.spans[0]
    way_s = 0.0 if span.is_leg else span.end_s - span.start_s
    begin, end = plan.sample(np.array((0.0, way_s))).position_in_world
    distance = float(np.linalg.norm(end - begin))
    value = f"{distance:.1f} m, {way_s:.0f} s away"
    findings = check_way_in(gathered.mission, plan)
    if findings:
        return _FIRST.stop(value, "; ".join(f"{finding.field}: {finding.text}" for finding in findings))
    if distance > TOO_FAR_M:
        return _FIRST.warning(value, "see that the mission file is meant for this place")
    return _FIRST.ok(value)
