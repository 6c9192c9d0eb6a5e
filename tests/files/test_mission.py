"""Mission files say where to fly; contradictions inside a leg are refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import pytest
from pydantic import ValidationError

from uasfly.errors import FileError
from uasfly.files import load_file
from uasfly.mission import (
    BackAndForthLeg,
    CircleLeg,
    FacingYaw,
    FigureEightLeg,
    FixedYaw,
    Mission,
    MissionLimits,
    PathYaw,
    WaypointsLeg,
)

TRACK = {"type": "back_and_forth", "start_m": (0, 0, 1), "end_m": (1, 0, 1), "speed_m_s": 1.0}
CIRCLE = {"type": "circle", "center_m": (0, 0), "radius_m": 1.0, "height_m": 1.0}
EIGHT = {"type": "figure_eight", "center_m": (0, 0), "height_m": 1.0, "length_m": 2.0, "width_m": 1.0}


def mission(**fields: object) -> Mission:
    """A mission of two hovers, with other fields as given."""
    hover = {"type": "hover", "position_m": (0, 0, 1), "duration_s": 1.0}
    return Mission.model_validate({"name": "m", "takeoff": {"height_m": 1.0}, "legs": [hover, dict(hover)], **fields})


def test_a_minimal_mission_lands_where_it_stands() -> None:
    """What a file leaves out has a safe default."""
    plain = mission()
    assert plain.ending.action == "land"
    assert plain.frame == "takeoff"
    assert plain.limits.wind_m_s is None
    assert plain.yaw == FixedYaw(yaw_deg=0.0)


def test_a_leg_may_override_the_missions_yaw_rule() -> None:
    """The other legs keep the mission's."""
    legs = [
        {"type": "hover", "position_m": (0, 0, 1), "duration_s": 1.0, "yaw": {"rule": "facing", "point_m": (1, 2)}},
        {"type": "hover", "position_m": (0, 0, 1), "duration_s": 1.0},
    ]
    flight = mission(legs=legs, yaw={"rule": "path"})
    assert flight.yaw_rule(0) == FacingYaw(rule="facing", point_m=(1.0, 2.0))
    assert flight.yaw_rule(1) == PathYaw(rule="path")


def test_degrees_in_the_file_are_radians_behind() -> None:
    """The property is what code uses."""
    assert FixedYaw(yaw_deg=90.0).yaw_rad == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("model", "base", "pair"),
    [
        (BackAndForthLeg, TRACK, {"passes": 3, "duration_s": 60.0}),
        (CircleLeg, CIRCLE, {"speed_m_s": 1.0, "period_s": 6.0}),
        (FigureEightLeg, EIGHT, {"speed_m_s": 1.0, "period_s": 6.0}),
    ],
)
def test_exactly_one_of_two_ways_to_say_it(
    model: type[BackAndForthLeg | CircleLeg | FigureEightLeg], base: Mapping[str, object], pair: Mapping[str, float]
) -> None:
    """Both would contradict each other, neither says nothing."""
    for name, value in pair.items():
        model.model_validate({**base, name: value})
    with pytest.raises(ValidationError, match="both are given"):
        model.model_validate({**base, **pair})
    with pytest.raises(ValidationError, match="neither is given"):
        model.model_validate(base)


def test_a_track_needs_two_ends() -> None:
    """Start and end at one point are no track."""
    with pytest.raises(ValidationError, match="must be apart"):
        BackAndForthLeg.model_validate({**TRACK, "end_m": TRACK["start_m"], "passes": 1})


def test_altitude_limits_are_in_order() -> None:
    """The lower one is the minimum."""
    with pytest.raises(ValidationError, match="altitude_min_m must be below"):
        MissionLimits(altitude_min_m=5.0, altitude_max_m=2.0)


def test_waypoints_need_two_points() -> None:
    """One point is a hover."""
    with pytest.raises(ValidationError):
        WaypointsLeg.model_validate({"type": "waypoints", "points": [{"position_m": (0, 0, 1)}]})


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e6])
def test_points_are_finite_and_near(value: float) -> None:
    """A coordinate of a thousand kilometres is a slip of the pen."""
    with pytest.raises(ValidationError):
        mission(legs=[{"type": "hover", "position_m": (value, 0, 1), "duration_s": 1.0}])


def test_a_mission_survives_its_own_json() -> None:
    """What the log stores is the mission again."""
    original = mission(limits={"geofence": {"radius_m": 5.0}}, yaw={"rule": "path"})
    assert Mission.model_validate_json(original.model_dump_json()) == original


def test_a_marker_and_its_frame_belong_together() -> None:
    """One without the other is a slip; the rest has defaults."""
    hangs = mission(frame="marker", marker={"bundle": "four_36h11"})
    assert hangs.marker is not None
    assert hangs.marker.until_seen.action == "hold"
    assert hangs.marker.until_seen.then == "end"
    assert hangs.marker.until_seen.turn_rate_rad_s == pytest.approx(math.radians(15.0))
    with pytest.raises(ValidationError, match="frame: marker needs the bundle"):
        mission(frame="marker")
    for frame in ("takeoff", "local"):
        with pytest.raises(ValidationError, match=f"found frame: {frame}"):
            mission(frame=frame, marker={"bundle": "four_36h11"})


@pytest.mark.parametrize(
    ("until_seen", "expected"),
    [
        ({"action": "look"}, "expected one of hold, search, found 'look'"),
        ({"turn_rate_deg_s": 0}, "turn_rate_deg_s"),
        ({"timeout_s": 0}, "timeout_s"),
        ({"then": "wait"}, "then"),
        ({"timout_s": 5}, "timeout_s"),
    ],
)
def test_slips_in_the_block_of_the_marker_are_named(
    tmp_path: Path, until_seen: Mapping[str, object], expected: str
) -> None:
    """With line, field and what was expected."""
    path = tmp_path / "m.yaml"
    block = "\n".join(f"    {key}: {value}" for key, value in until_seen.items())
    path.write_text(
        "name: m\nframe: marker\nmarker:\n  bundle: four_36h11\n  until_seen:\n"
        f"{block}\ntakeoff: {{height_m: 1.0}}\nlegs:\n  - {{type: hover, position_m: [4.2, 0, 0.2], duration_s: 5}}\n"
    )
    with pytest.raises(FileError) as caught:
        load_file(path, Mission)
    (problem,) = caught.value.problems
    assert problem.startswith("line 6: marker.until_seen.")
    assert expected in problem
