"""Each type of leg flies what its file says; the paper's figures are met."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.trajectories.motion import (
    HOME,
    LIMITS,
    LegFields,
    assert_consistent,
    fly,
    leg_samples,
    mission,
    peak,
    peak_jerk,
)
from uasfly.messages import ReferenceHorizon
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.trajectory import TrajectoryError

HOVER = {"type": "hover", "position_m": (1.0, 2.0, 1.5), "duration_s": 10.0}
TRACK = {"type": "back_and_forth", "start_m": (-1, 0, 1.5), "end_m": (1, 0, 1.5), "speed_m_s": 0.4, "stop_s": 5.0}
SPIRAL = {
    "type": "spiral",
    "center_m": (0, 0),
    "radius_m": 1.0,
    "height_start_m": 0.75,
    "height_end_m": 2.25,
    "turns": 3.0,
    "duration_s": 120.0,
}
CIRCLE = {"type": "circle", "center_m": (1, 2), "radius_m": 2.0, "height_m": 1.0, "turns": 1.5, "start_angle_deg": 90.0}
EIGHT = {"type": "figure_eight", "center_m": (0, 0), "height_m": 1.0, "length_m": 4.0, "width_m": 2.0}
WAYPOINTS = [{"position_m": (0, 0, 1.5)}, {"position_m": (3, 0, 1.5)}, {"position_m": (3, 3, 1.5)}]


def way(reference: ReferenceHorizon) -> float:
    """Length of the sampled path [m]."""
    return float(np.linalg.norm(np.diff(reference.position_in_world, axis=0), axis=1).sum())


def test_hover_stands_for_its_duration() -> None:
    """Not a millimetre of motion."""
    trajectory = fly(HOVER)
    reference = leg_samples(trajectory, 0)
    assert reference.time_s[-1] - reference.time_s[0] == pytest.approx(10.0)
    np.testing.assert_allclose(reference.position_in_world, np.tile((1.0, 2.0, 1.5), (len(reference.time_s), 1)))
    assert peak(reference.velocity_in_world) == 0.0


def test_back_and_forth_flies_as_many_passes_as_fit() -> None:
    """The paper's track: 0.4 m/s, stops of 5 s at both ends, the first and the last included, within 120 s."""
    trajectory = fly({**TRACK, "duration_s": 120.0})
    reference = leg_samples(trajectory, 0)
    x, speed = reference.position_in_world[:, 0], np.linalg.norm(reference.velocity_in_world, axis=1)
    flown = reference.time_s[-1] - reference.time_s[0]
    changes = np.flatnonzero(np.diff((speed > 1e-9).astype(int)))
    moves, stops = changes[1::2] - changes[::2], changes[2::2] - changes[1:-1:2]
    pass_s, passes = moves[0] * 0.01, len(moves)
    assert passes == 10
    assert flown <= 120.0 < flown + pass_s + 5.0
    np.testing.assert_allclose(stops * 0.01, 5.0, atol=0.021)
    assert speed.max() == pytest.approx(0.4)
    assert (x.min(), x.max()) == pytest.approx((-1.0, 1.0))
    np.testing.assert_allclose(reference.position_in_world[:, 1:], np.tile((0.0, 1.5), (len(x), 1)), atol=1e-12)


def test_back_and_forth_flies_the_passes_asked_for() -> None:
    """An odd number ends at the far end."""
    trajectory = fly({**TRACK, "passes": 3})
    np.testing.assert_allclose(leg_samples(trajectory, 0).position_in_world[-1], (1.0, 0.0, 1.5), atol=1e-9)


@pytest.mark.parametrize(("duration", "expected"), [(10.0, "too short for one pass"), (16.0, "give at least")])
def test_back_and_forth_says_when_not_one_pass_fits(duration: float, expected: str) -> None:
    """The shortest possible duration is named."""
    with pytest.raises(TrajectoryError, match=expected) as caught:
        fly({**TRACK, "duration_s": duration})
    assert caught.value.field == "legs[0].duration_s"


def test_back_and_forth_refuses_thousands_of_passes() -> None:
    """A track of a centimetre for two hours is a slip of the pen."""
    with pytest.raises(TrajectoryError, match="at most 1000"):
        fly({**TRACK, "end_m": (-0.99, 0, 1.5), "stop_s": 0.0, "duration_s": 7000.0})


def test_the_spiral_has_the_papers_figures() -> None:
    """Radius 1 m, 0.75 to 2.25 m, three turns, 120 s from rest to rest, its climb even along the way."""
    trajectory = fly(SPIRAL)
    reference = leg_samples(trajectory, 0)
    x, y, z = reference.position_in_world.T
    angle = np.unwrap(np.arctan2(y, x))
    assert reference.time_s[-1] - reference.time_s[0] == pytest.approx(120.0, abs=1e-9)
    np.testing.assert_allclose(np.hypot(x, y), 1.0, atol=1e-12)
    assert angle[-1] - angle[0] == pytest.approx(6.0 * math.pi)
    np.testing.assert_allclose(z, 0.75 + 1.5 * (angle - angle[0]) / (6.0 * math.pi), atol=1e-9)
    np.testing.assert_allclose(reference.position_in_world[0], (1.0, 0.0, 0.75), atol=1e-12)
    speed = np.linalg.norm(reference.velocity_in_world, axis=1)
    length = math.hypot(6.0 * math.pi, 1.5)
    assert speed.max() == pytest.approx(length / 120.0, rel=0.01)
    assert np.mean(speed > 0.999 * speed.max()) > 0.98


def test_a_clockwise_spiral_downwards_mirrors_it() -> None:
    """Direction and climb are independent."""
    reference = leg_samples(fly({**SPIRAL, "direction": "clockwise", "height_start_m": 2.25, "height_end_m": 0.75}), 0)
    x, y, z = reference.position_in_world.T
    angle = np.unwrap(np.arctan2(y, x))
    assert angle[-1] - angle[0] == pytest.approx(-6.0 * math.pi)
    assert (z[0], z[-1]) == pytest.approx((2.25, 0.75))


def test_a_spiral_that_is_too_quick_names_its_shortest_duration() -> None:
    """And with that duration it flies."""
    with pytest.raises(TrajectoryError, match=r"give at least (\d+\.\d) s") as caught:
        fly({**SPIRAL, "duration_s": 5.0})
    shortest = float(str(caught.value).split("at least ")[1].split(" s")[0])
    fly({**SPIRAL, "duration_s": shortest + 0.1})


def test_a_circle_turns_at_its_period_once_it_cruises() -> None:
    """Speed or period, turns, start angle and height as the file says; starting and stopping take longer."""
    reference = leg_samples(fly({**CIRCLE, "period_s": 20.0}), 0)
    x, y, z = (reference.position_in_world - np.array((1.0, 2.0, 1.0))).T
    angle = np.unwrap(np.arctan2(y, x))
    speed = np.linalg.norm(reference.velocity_in_world, axis=1)
    np.testing.assert_allclose(np.hypot(x, y), 2.0, atol=1e-12)
    np.testing.assert_allclose(z, 0.0, atol=1e-12)
    assert (angle[0], angle[-1]) == pytest.approx((0.5 * math.pi, 3.5 * math.pi))
    assert speed.max() == pytest.approx(4.0 * math.pi / 20.0)
    same = leg_samples(fly({**CIRCLE, "speed_m_s": 4.0 * math.pi / 20.0}), 0)
    np.testing.assert_allclose(same.position_in_world, reference.position_in_world, atol=1e-9)


def test_an_eight_crosses_its_centre_fastest_and_fills_its_box() -> None:
    """4 m from tip to tip, lobes 2 m wide, turned to its heading."""
    reference = leg_samples(fly({**EIGHT, "heading_deg": 90.0, "speed_m_s": 1.0, "turns": 2.0}), 0, 0.005)
    x, y, _ = reference.position_in_world.T
    speed = np.linalg.norm(reference.velocity_in_world, axis=1)
    assert (y.min(), y.max()) == pytest.approx((-2.0, 2.0), abs=1e-3)
    assert (x.min(), x.max()) == pytest.approx((-1.0, 1.0), abs=1e-3)
    assert speed.max() == pytest.approx(1.0, abs=1e-4)
    assert np.hypot(x, y)[speed.argmax()] < 0.01
    assert (x[0], y[0], x[-1], y[-1]) == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=1e-9)


def test_a_line_without_a_start_begins_where_the_leg_before_it_ended() -> None:
    """No transition lies between them."""
    trajectory = fly(HOVER, {"type": "line", "to_m": (4.0, 6.0, 1.5), "speed_m_s": 1.0})
    assert [(span.leg, span.is_leg) for span in trajectory.spans] == [(0, False), (0, True), (1, True)]
    reference = leg_samples(trajectory, 1)
    np.testing.assert_allclose(reference.position_in_world[[0, -1]], ((1.0, 2.0, 1.5), (4.0, 6.0, 1.5)), atol=1e-9)
    assert peak(reference.velocity_in_world) == pytest.approx(1.0)
    assert way(reference) == pytest.approx(5.0)


def test_a_line_to_where_the_vehicle_is_takes_a_moment() -> None:
    """It stays a leg with a time of its own."""
    trajectory = fly({"type": "line", "to_m": tuple(HOME), "speed_m_s": 1.0})
    assert 0.0 < trajectory.duration_s < 0.1
    assert trajectory.in_leg(0.01)


def test_waypoints_without_stop_are_passed_in_flight_and_others_stopped_at() -> None:
    """At a stop the vehicle rests for the time asked."""
    passed = leg_samples(fly({"type": "waypoints", "speed_m_s": 1.0, "points": WAYPOINTS}), 0)
    corner = np.linalg.norm(passed.position_in_world - (3.0, 0.0, 1.5), axis=1).argmin()
    assert np.linalg.norm(passed.velocity_in_world[corner]) > 0.5
    points = [WAYPOINTS[0], {**WAYPOINTS[1], "stop_s": 2.0}, WAYPOINTS[2]]
    stopped = leg_samples(fly({"type": "waypoints", "speed_m_s": 1.0, "points": points}), 0)
    at_rest = np.linalg.norm(stopped.velocity_in_world, axis=1) < 1e-9
    there = np.linalg.norm(stopped.position_in_world - (3.0, 0.0, 1.5), axis=1) < 1e-9
    assert np.sum(at_rest & there) * 0.01 == pytest.approx(2.0, abs=0.03)
    assert way(stopped) == pytest.approx(6.0)


def test_waypoints_keep_the_speed_on_the_way_to_each() -> None:
    """A point's own speed, else the leg's, else the transition's."""
    points = [WAYPOINTS[0], {**WAYPOINTS[1], "speed_m_s": 0.3, "stop_s": 0.0}, {**WAYPOINTS[2], "stop_s": 1.0}]
    reference = leg_samples(fly({"type": "waypoints", "points": points}), 0)
    first = reference.position_in_world[:, 1] == 0.0
    assert peak(reference.velocity_in_world[first]) == pytest.approx(0.3)
    assert peak(reference.velocity_in_world[~first]) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "leg",
    [
        {**TRACK, "passes": 2, "stop_s": 0.0},
        {**SPIRAL, "duration_s": 60.0},
        {**CIRCLE, "speed_m_s": 1.0},
        {**EIGHT, "speed_m_s": 1.5},
        {"type": "line", "to_m": (3, 3, 3), "speed_m_s": 2.0},
        {"type": "waypoints", "speed_m_s": 1.0, "points": WAYPOINTS},
    ],
    ids=lambda leg: str(leg["type"]),
)
def test_derivatives_are_consistent_and_jerk_is_bounded(leg: LegFields) -> None:
    """From before the start to after the end, over all joints."""
    trajectory = fly({**leg, "acceleration_m_s2": 0.8, "jerk_m_s3": 1.6})
    assert_consistent(trajectory, jerk=4.0)
    assert peak_jerk(trajectory) < 4.0


def test_a_legs_own_acceleration_and_jerk_rule_it() -> None:
    """The transition to it keeps the mission's."""
    leg = {"type": "line", "from_m": (0, 0, 2), "to_m": (20, 0, 2), "speed_m_s": 3.0}
    trajectory = fly({**leg, "acceleration_m_s2": 2.0, "jerk_m_s3": 5.0})
    assert peak(leg_samples(trajectory, 0).acceleration_in_world) == pytest.approx(2.0)
    before = trajectory.sample(np.arange(0.0, trajectory.spans[0].end_s, 0.01))
    assert peak(before.acceleration_in_world) <= 0.5 + 1e-9


def test_hours_are_refused_before_they_are_built() -> None:
    """Two hours are more than any battery lasts."""
    slow = {"type": "line", "to_m": (9000, 0, 2), "speed_m_s": 0.001}
    with pytest.raises(TrajectoryError, match="at most 7200 s"):
        fly(slow)
    with pytest.raises(TrajectoryError, match=r"legs\[1\]"):
        fly({**HOVER, "duration_s": 7000.0}, {**HOVER, "duration_s": 7000.0})
    with pytest.raises(TrajectoryError, match="the way to it"):
        MissionTrajectory(mission({**HOVER, "position_m": (9000, 0, 2)}), LIMITS, HOME, 0.0)
