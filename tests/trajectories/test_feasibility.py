"""What a mission asks and an airframe cannot do is found before the flight, with a mend that works."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from tests.trajectories.motion import LegFields
from tests.trajectories.motion import mission as any_mission
from uasfly.airframe import Airframe
from uasfly.files import find_file, load_file, parse_overrides
from uasfly.mission import Mission
from uasfly.trajectories.feasibility import Finding, check_mission, check_placed
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.placement import Placement

HOVER = {"type": "hover", "position_m": (0, 0, 1.5), "duration_s": 5.0}
LINE = {"type": "line", "to_m": (60, 0, 1.5), "speed_m_s": 2.0, "acceleration_m_s2": 1.0}
CIRCLE = {"type": "circle", "center_m": (0, 0), "radius_m": 2.0, "height_m": 1.5, "speed_m_s": 1.0}
SPIRAL = {
    "type": "spiral",
    "center_m": (0, 0),
    "radius_m": 1.0,
    "height_start_m": 1,
    "height_end_m": 20,
    "duration_s": 30.0,
    "acceleration_m_s2": 2.0,
}


def mission(
    *legs: LegFields, wind_m_s: float = 3.0, limits: Mapping[str, object] | None = None, **fields: object
) -> Mission:
    """A mission for light wind, so that wind is a finding only where a test asks for it."""
    return any_mission(*legs, limits={"wind_m_s": wind_m_s, **(limits or {})}, **fields)


@pytest.fixture(scope="module")
def f550() -> Airframe:
    """5 m/s, climbs 2, descends 1.5, accelerates 3 m/s^2, turns 90 deg/s, tilts 30 deg."""
    return load_file(find_file("airframe", "f550"), Airframe)


def only(findings: list[Finding], severity: str = "error") -> Finding:
    """The one finding there is, of this severity."""
    (finding,) = findings
    assert finding.severity == severity, finding
    return finding


def suggestion(finding: Finding) -> tuple[str, float]:
    """Field and value of the mend that the text proposes."""
    match = re.search(r"(?:lower|raise) (?:legs\[\d+\]\.|transition\.)?(\w+) to ([0-9.]+)", finding.text)
    assert match, finding.text
    return match[1], float(match[2])


def test_a_mission_within_the_limits_has_no_findings(f550: Airframe) -> None:
    """Nothing to say."""
    assert check_mission(mission(HOVER, CIRCLE, LINE), f550) == []


@pytest.mark.parametrize(
    ("leg", "field", "words"),
    [
        ({**LINE, "speed_m_s": 8.0}, "legs[0].speed_m_s", "a speed of 7.26 m/s; limits.speed_m_s of f550 is 5"),
        ({**SPIRAL, "duration_s": 12.0}, "legs[0].duration_s", "a climb of"),
        (
            {"type": "line", "from_m": (0, 0, 30), "to_m": (0, 0, 2), "speed_m_s": 2.0},
            "legs[0].speed_m_s",
            "a descent of 2.00 m/s; limits.descent_m_s of f550 is 1.5",
        ),
        (
            {**CIRCLE, "speed_m_s": 3.0, "turns": 3, "acceleration_m_s2": 1.0},
            "legs[0].speed_m_s",
            "an acceleration of 4.5",
        ),
        ({**CIRCLE, "period_s": 4.8, "speed_m_s": None, "turns": 3}, "legs[0].period_s", "an acceleration of"),
        ({**LINE, "acceleration_m_s2": 4.0, "jerk_m_s3": 20.0}, "legs[0].acceleration_m_s2", "of 4.00 m/s^2"),
    ],
)
def test_too_fast_and_too_quick_are_errors_and_the_mend_mends(
    f550: Airframe, leg: LegFields, field: str, words: str
) -> None:
    """The value that the text proposes makes the error go away."""
    finding, *others = check_mission(mission(leg), f550)
    assert {other.severity for other in others} <= {"warning"}
    assert (finding.severity, finding.field) == ("error", field)
    assert words in finding.text
    name, value = suggestion(finding)
    assert check_mission(mission({**leg, name: value}), f550) == []


def test_waypoints_that_are_too_fast_are_told_by_a_factor(f550: Airframe) -> None:
    """Their speeds stand in several places."""
    points = [{"position_m": (0, 0, 1.5)}, {"position_m": (60, 0, 1.5), "speed_m_s": 7.0}]
    leg = {"type": "waypoints", "points": points, "acceleration_m_s2": 2.0}
    finding = only(check_mission(mission(leg), f550))
    assert finding.field == "legs[0]"
    assert "multiply its speeds by 0.71" in finding.text


def test_a_yaw_rate_beyond_the_limit_is_an_error(f550: Airframe) -> None:
    """Facing a point beside the track asks for a whirl."""
    leg = {**LINE, "yaw": {"rule": "facing", "point_m": (30.0, 0.2)}}
    finding = only(check_mission(mission(leg), f550))
    assert finding.field == "legs[0].yaw"
    assert "limits.yaw_rate_deg_s of f550 is 90" in finding.text


@pytest.mark.parametrize(
    ("limits", "field"),
    [
        ({"geofence": {"radius_m": 50.0}}, "limits.geofence.radius_m"),
        ({"geofence": {"radius_m": 35.0, "center_m": (40, 0)}}, "limits.geofence.radius_m"),
        ({"altitude_max_m": 1.9}, "limits.altitude_max_m"),
        ({"altitude_min_m": 1.2}, "limits.altitude_min_m"),
    ],
)
def test_leaving_the_fence_or_the_altitudes_is_an_error(
    f550: Airframe, limits: Mapping[str, object], field: str
) -> None:
    """Legs and transitions alike."""
    high, low = {**HOVER, "position_m": (0, 0, 2.0)}, {**HOVER, "position_m": (0, 0, 1.0)}
    findings = check_mission(mission(high, low, {**LINE, "from_m": (0, 0, 1.5)}, limits=limits), f550)
    assert findings
    assert {finding.field for finding in findings} == {field}
    assert all(finding.severity == "error" for finding in findings)


def test_a_transition_outside_the_fence_is_found(f550: Airframe) -> None:
    """Both legs lie inside a small fence that the way from the take-off point to them does not."""
    leg = {**HOVER, "position_m": (20, 0, 1.5)}
    finding = only(check_mission(mission(leg, limits={"geofence": {"radius_m": 5.0, "center_m": (20, 0)}}), f550))
    assert "the way to legs[0]" in finding.text
    assert (
        check_mission(mission(leg, frame="local", limits={"geofence": {"radius_m": 5.0, "center_m": (20, 0)}}), f550)
        == []
    )


def test_the_take_off_ends_within_the_altitudes(f550: Airframe) -> None:
    """Too low and too high."""
    for limits in ({"altitude_min_m": 1.6}, {"altitude_max_m": 1.4}):
        findings = check_mission(mission(HOVER, limits=limits), f550)
        assert "takeoff.height_m" in {finding.field for finding in findings}


def test_wind_needs_tilt_and_the_mend_says_how_much_is_possible(f550: Airframe) -> None:
    """f550: 30 deg hold 21.7 m/s, 15 % less leaves room for gusts."""
    error, warning = check_mission(mission(HOVER, wind_m_s=25.0), f550)
    assert (error.severity, error.field) == ("error", "limits.wind_m_s")
    assert "f550 may tilt 30 deg" in error.text
    assert "lower limits.wind_m_s to 18," in error.text
    assert (warning.severity, warning.field) == ("warning", "limits.wind_m_s")
    assert "sized for" in warning.text
    severities = [finding.severity for finding in check_mission(mission(HOVER, wind_m_s=20.0), f550)]
    assert severities == ["warning", "warning"]
    only(check_mission(mission(HOVER, wind_m_s=18.0), f550), "warning")


def test_accelerating_in_wind_needs_both(f550: Airframe) -> None:
    """What fits alone does not fit together."""
    quick = {**LINE, "acceleration_m_s2": 3.0, "jerk_m_s3": 10.0}
    assert check_mission(mission(quick), f550) == []
    finding = only(check_mission(mission(quick, wind_m_s=14.0), f550))
    assert finding.field == "limits.wind_m_s"
    assert "deg of tilt" in finding.text


def test_without_drag_less_wind_is_no_mend(f550: Airframe) -> None:
    """A vehicle without drag tilts for what it accelerates alone."""
    settings = ["model.drag_1_s=[0, 0, 0]", "limits.tilt_deg=15", "limits.acceleration_m_s2=5"]
    smooth = load_file(find_file("airframe", "f550"), Airframe, parse_overrides(settings))
    finding = only(check_mission(mission({**LINE, "acceleration_m_s2": 4.0, "jerk_m_s3": 20.0}), smooth))
    assert "deg of tilt" in finding.text
    assert "lower limits.wind_m_s" not in finding.text


def test_thrust_needs_headroom_too(f550: Airframe) -> None:
    """A weak vehicle hovers and cannot lean into the wind; a lively one cannot fall as fast as asked."""
    weak = load_file(
        find_file("airframe", "f550"),
        Airframe,
        parse_overrides(
            ["limits.thrust_max=0.37", "limits.thrust_min=0.3", "limits.climb_m_s=9", "limits.descent_m_s=9"]
        ),
    )
    findings = check_mission(mission(HOVER, wind_m_s=14.0), weak)
    assert any("takes a thrust of 0.37" in finding.text and finding.severity == "warning" for finding in findings)
    assert any(
        "takes a thrust of 0.38" in finding.text and finding.severity == "error"
        for finding in check_mission(mission(HOVER, wind_m_s=18.0), weak)
    )
    drop = {"type": "line", "from_m": (0, 0, 30), "to_m": (0, 0, 2), "speed_m_s": 4.0, "acceleration_m_s2": 2.5}
    falling = check_mission(mission(drop, wind_m_s=1.0), weak)
    assert any(finding.field == "legs[0]" and "falls so fast" in finding.text for finding in falling)


def test_transitions_faster_than_the_airframe_are_a_warning(f550: Airframe) -> None:
    """They keep to its limits, so nothing is lost but time."""
    finding = only(check_mission(mission(HOVER, transition={"speed_m_s": 9.0}), f550), "warning")
    assert finding.field == "transition.speed_m_s"


def test_a_leg_that_cannot_be_built_is_one_error(f550: Airframe) -> None:
    """Its own text names what is possible."""
    finding = only(check_mission(mission({**SPIRAL, "duration_s": 2.0}), f550))
    assert finding.field == "legs[0].duration_s"
    assert "give at least" in finding.text


def test_errors_come_first(f550: Airframe) -> None:
    """A warning never hides an error."""
    findings = check_mission(mission({**LINE, "speed_m_s": 8.0}, transition={"speed_m_s": 9.0}), f550)
    assert [finding.severity for finding in findings] == sorted(finding.severity for finding in findings)


def test_missions_come_from_files_too(f550: Airframe) -> None:
    """The same check, by name."""
    fast = load_file(find_file("mission", "circle"), Mission, parse_overrides(["legs[0].period_s=3"]))
    assert any(finding.field == "legs[0].period_s" for finding in check_mission(fast, f550))


MARKER: dict[str, Any] = {"frame": "marker", "marker": {"bundle": "four_36h11"}}
STANDOFF = {"type": "hover", "position_m": (4.2, 0, 0.2), "duration_s": 5.0}


def test_a_mission_of_a_marker_is_checked_without_knowing_where_it_is(f550: Airframe) -> None:
    """As if its first leg began where the take-off ends; what is then outside is a warning only."""
    fenced = {"geofence": {"radius_m": 3.0}, "altitude_max_m": 2.0}
    assert check_mission(mission(STANDOFF, **MARKER, limits=fenced), f550) == []
    far = {**STANDOFF, "position_m": (4.2, 4.0, 1.2)}
    findings = check_mission(mission(STANDOFF, far, **MARKER, limits=fenced), f550)
    assert {(finding.severity, finding.field) for finding in findings} == {
        ("warning", "limits.geofence.radius_m"),
        ("warning", "limits.altitude_max_m"),
    }
    assert all("if the first leg begins where the take-off ends" in finding.text for finding in findings)


def test_an_airframes_limits_are_errors_in_a_markers_frame_too(f550: Airframe) -> None:
    """A leg that is too fast is too fast anywhere, and so is a take-off beyond the altitudes."""
    fast = {**LINE, "from_m": (3, 0, 0), "speed_m_s": 9.0}
    assert only(check_mission(mission(fast, **MARKER, limits={"altitude_min_m": 0.5}), f550)).field.startswith(
        "legs[0]"
    )
    low = mission(STANDOFF, **MARKER, limits={"altitude_min_m": 2.0})
    assert "takeoff.height_m" in {finding.field for finding in check_mission(low, f550)}


def test_a_bundle_that_nobody_has_is_an_error(f550: Airframe) -> None:
    """With the names there are."""
    lost = mission(STANDOFF, frame="marker", marker={"bundle": "for_36h11"})
    finding = only(check_mission(lost, f550))
    assert finding.field == "marker.bundle"
    assert "did you mean four_36h11" in finding.text


def test_a_placed_mission_is_held_against_the_fence_around_the_take_off(f550: Airframe) -> None:
    """Ways between the legs included; in place it has nothing to say."""
    flight = mission(STANDOFF, **MARKER, limits={"geofence": {"radius_m": 6.0}})
    take_off, start = np.array((1.0, 2.0, 0.0)), np.array((1.0, 2.0, 1.5))
    for distance, fields in ((8.0, []), (12.0, ["limits.geofence.radius_m"] * 2)):
        placement = Placement(np.array((1.0 + distance, 2.0, 1.3)), math.pi)
        trajectory = MissionTrajectory(flight, f550.limits, start, 0.0, placement)
        assert [finding.field for finding in check_placed(flight, trajectory, take_off)] == fields
