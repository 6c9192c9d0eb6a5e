"""Home, geofence and the way to the first leg."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.flight.preflight.gathering import (
    OK,
    PLACE,
    STOP,
    WARNING,
    check,
    estimate,
    facts,
    gathered,
    mission,
    verdict,
    view,
)
from uasfly.flight.preflight import judge
from uasfly.preflight_messages import Verdict

LOST: dict[str, Any] = {"estimate": None, "origin": None, "diagnosis": None}


def test_home_is_where_the_vehicle_stands() -> None:
    """A vehicle that was carried away from it is told on the ground; in the air it may be anywhere."""
    assert check("home").value == "0.0 m away"
    away = facts(home=PLACE + np.array((30.0, 40.0, 0.0)))
    line = check("home", facts=away)
    assert (line.verdict, line.value) == (WARNING, "50.0 m away")
    assert verdict("home", facts=away, view=view(in_air=True)) is OK
    assert verdict("home", **LOST) is WARNING


def test_without_home_a_mission_cannot_end_with_a_return() -> None:
    """Otherwise it is a warning, also where nothing was asked."""
    assert verdict("home", facts=facts(home=None)) is WARNING
    assert verdict("home", facts=None) is WARNING
    assert verdict("home", facts=facts(home=None), mission=mission(ending={"action": "return"})) is STOP


@pytest.mark.parametrize(("center", "expected"), [((0.0, 0.0), OK), ((5.0, 0.0), OK), ((7.0, 0.0), STOP)])
def test_the_vehicle_is_inside_the_fence(center: tuple[float, float], expected: Verdict) -> None:
    """Of radius 6 m around a point of the mission's frame."""
    fenced = mission(limits={"geofence": {"radius_m": 6.0, "center_m": center}, "altitude_max_m": 5.0})
    line = check("geofence", mission=fenced)
    assert line.verdict is expected
    assert line.value == f"{center[0]:.1f} m from its centre, radius 6 m"


def test_a_fence_that_is_not_there_is_told() -> None:
    """As is a place that is not known."""
    assert verdict("geofence", mission=mission(limits={})) is WARNING
    assert verdict("geofence", **LOST) is WARNING


def test_the_first_waypoint_is_told_with_its_way() -> None:
    """From the take-off, above the point where it stands."""
    line = check("first waypoint")
    assert line.verdict is OK
    assert line.value.startswith("2.0 m, ")
    (on_the_spot,) = [
        found
        for found in judge(gathered(view=view(in_air=True), estimate=estimate(PLACE + np.array((2.0, 0.0, 1.5)))))
        if found.name == "first waypoint"
    ]
    assert on_the_spot.value == "0.0 m, 0 s away"


def test_a_way_that_leaves_the_limits_is_a_stop() -> None:
    """From a vehicle outside of the fence, above the greatest height, or under the lowest."""
    for place in ((9.0, 0.0, 1.5), (0.0, 0.0, 7.0), (0.0, 0.0, 0.1)):
        line = check("first waypoint", view=view(in_air=True), estimate=estimate(PLACE + np.array(place)))
        assert line.verdict is STOP
        assert "limits." in line.remedy


def test_a_mission_of_the_local_frame_may_be_far_away() -> None:
    """Without a fence a warning from 100 m on; with one a stop."""
    local = {"frame": "local", "legs": [{"type": "hover", "position_m": [300.0, 0.0, 1.5], "duration_s": 5.0}]}
    place = {"estimate": estimate((0.0, 0.0, 0.0)), "origin": np.zeros(3)}
    line = check("first waypoint", mission=mission(**local, limits={}), **place)
    assert line.verdict is WARNING
    assert line.value.startswith("300.0 m, ")
    fenced = mission(**local, limits={"geofence": {"radius_m": 50.0, "center_m": (300.0, 0.0)}})
    assert verdict("first waypoint", mission=fenced, **place) is STOP
    assert verdict("geofence", mission=fenced, **place) is STOP


def test_a_mission_that_cannot_be_flown_from_here_is_a_stop() -> None:
    """The way alone takes longer than a mission may; its duration is then no question."""
    slow = mission(transition={"speed_m_s": 0.01}, limits={})
    flying = view(in_air=True)
    lines = judge(gathered(mission=slow, view=flying, estimate=estimate(PLACE + np.array((200.0, 0.0, 1.5)))))
    by_name = {line.name: line for line in lines}
    assert by_name["first waypoint"].verdict is STOP
    assert "legs[0]" in by_name["first waypoint"].remedy
    assert "endurance" not in by_name


def test_a_place_that_is_not_known_is_told() -> None:
    """No estimate, or one that is no number."""
    assert verdict("first waypoint", **LOST) is WARNING
    assert verdict("geofence", estimate=estimate((np.nan, 0.0, 0.0))) is WARNING
    assert verdict("first waypoint", estimate=estimate((np.nan, 0.0, 0.0))) is WARNING


def test_a_mission_of_a_marker_has_its_first_waypoint_where_nobody_knows_yet() -> None:
    """That is told; what its fence says of the place where it stands is told as ever."""
    hangs = {"frame": "marker", "marker": {"bundle": "four_36h11"}}
    line = check("first waypoint", mission=mission(**hangs))
    assert line.verdict is OK
    assert "marker" in line.value
    assert verdict("geofence", mission=mission(**hangs)) is OK
    slow = mission(
        **hangs, legs=[{"type": "waypoints", "points": [{"position_m": [0, 0, 1]}, {"position_m": [9e3, 0, 1]}]}]
    )
    assert verdict("first waypoint", mission=slow) is STOP
