"""A whole mission is one smooth reference that knows its legs."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trajectories.motion import HOME, LIMITS, LegFields, assert_consistent, fly, mission, peak, peak_jerk
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.placement import Placement

LEGS: tuple[LegFields, ...] = (
    {"type": "hover", "position_m": (0, 0, 1.5), "duration_s": 3.0},
    {"type": "circle", "center_m": (1, 1), "radius_m": 1.0, "height_m": 2.0, "speed_m_s": 0.6, "name": "round"},
    {"type": "line", "to_m": (3, 1, 1.0), "speed_m_s": 1.0, "yaw": {"rule": "path"}},
    {
        "type": "back_and_forth",
        "start_m": (-1, 0, 1.5),
        "end_m": (1, 0, 1.5),
        "speed_m_s": 0.5,
        "passes": 2,
        "yaw": {"rule": "path"},
    },
    {
        "type": "spiral",
        "center_m": (0, 0),
        "radius_m": 1.0,
        "height_start_m": 1,
        "height_end_m": 2,
        "duration_s": 20.0,
        "yaw": {"rule": "facing", "point_m": (0, 0)},
    },
    {"type": "figure_eight", "center_m": (0, 1), "height_m": 1.5, "length_m": 3.0, "width_m": 1.5, "period_s": 15.0},
    {
        "type": "waypoints",
        "points": [{"position_m": (0, 0, 1)}, {"position_m": (2, 0, 1)}, {"position_m": (2, 2, 2)}],
        "yaw": {"rule": "path"},
    },
)
START = np.array((0.3, -0.2, 1.4))

coordinate = st.floats(-5.0, 5.0)
point = st.tuples(coordinate, coordinate, st.floats(1.0, 5.0))
yaw_rules = st.one_of(
    st.builds(lambda yaw: {"rule": "fixed", "yaw_deg": yaw}, st.floats(-180.0, 180.0)),
    st.just({"rule": "path"}),
    st.builds(lambda x, y: {"rule": "facing", "point_m": (x, y)}, coordinate, coordinate),
)
legs = st.one_of(
    st.builds(lambda p, yaw: {"type": "hover", "position_m": p, "duration_s": 2.0, "yaw": yaw}, point, yaw_rules),
    st.builds(
        lambda p, v, yaw: {"type": "line", "to_m": p, "speed_m_s": v, "yaw": yaw}, point, st.floats(0.3, 3.0), yaw_rules
    ),
    st.builds(
        lambda p, r, v, yaw: {
            "type": "circle",
            "center_m": p[:2],
            "height_m": p[2],
            "radius_m": r,
            "speed_m_s": v,
            "turns": 0.7,
            "yaw": yaw,
        },
        point,
        st.floats(0.5, 3.0),
        st.floats(0.2, 1.0),
        yaw_rules,
    ),
    st.builds(
        lambda a, b, c, stop, yaw: {
            "type": "waypoints",
            "speed_m_s": 1.0,
            "points": [{"position_m": a}, {"position_m": b, "stop_s": stop}, {"position_m": c}],
            "yaw": yaw,
        },
        point,
        point,
        point,
        st.one_of(st.none(), st.floats(0.0, 2.0)),
        yaw_rules,
    ),
)


@pytest.fixture(scope="module")
def trajectory() -> MissionTrajectory:
    """All types of legs in one mission."""
    return fly(*LEGS, start=START, start_yaw=2.5)


def test_position_velocity_acceleration_and_yaw_fit_together_everywhere(trajectory: MissionTrajectory) -> None:
    """Also over the joints, before the start and after the end."""
    assert_consistent(trajectory, jerk=3.0)
    assert peak_jerk(trajectory) < 3.0


@given(st.lists(legs, min_size=1, max_size=4), st.floats(-10.0, 10.0))
@settings(max_examples=25, deadline=None)
def test_any_mission_is_smooth_and_turns_within_its_rate(mission_legs: list[LegFields], start_yaw: float) -> None:
    """Whatever the legs and yaw rules are."""
    flight = fly(*mission_legs, start_yaw=start_yaw)
    centripetal_jerk = 1.0**3 / 0.5**2 + 3.0 * 0.5 * 1.0 / 0.5
    assert_consistent(flight, jerk=1.0 + centripetal_jerk, yaw_acceleration=2000.0, step_s=0.02)
    reference = flight.sample(np.arange(0.0, flight.duration_s, 0.01))
    assert np.abs(reference.yaw_rate_rad_s).max() <= 1.01 * LIMITS.yaw_rate_rad_s
    assert np.abs(np.diff(reference.yaw_rad)).max(initial=0.0) <= 0.0101 * LIMITS.yaw_rate_rad_s


def test_it_holds_its_first_and_last_pose_outside(trajectory: MissionTrajectory) -> None:
    """Times are clamped, the times themselves are handed back."""
    times = np.array((-5.0, 0.0, trajectory.duration_s, trajectory.duration_s + 5.0))
    reference = trajectory.sample(times)
    np.testing.assert_array_equal(reference.time_s, times)
    np.testing.assert_allclose(reference.position_in_world[0], START)
    np.testing.assert_allclose(reference.position_in_world[:2], np.tile(START, (2, 1)))
    np.testing.assert_allclose(reference.position_in_world[2:], np.tile((2.0, 2.0, 2.0), (2, 1)), atol=1e-9)
    np.testing.assert_allclose(reference.velocity_in_world, 0.0, atol=1e-9)
    np.testing.assert_allclose(reference.acceleration_in_world, 0.0, atol=1e-9)
    assert reference.yaw_rad[0] == pytest.approx(2.5)
    np.testing.assert_allclose(reference.yaw_rate_rad_s, 0.0, atol=1e-9)


def test_samples_do_not_depend_on_what_is_sampled_with_them(trajectory: MissionTrajectory) -> None:
    """A horizon over several legs equals its times one by one; nothing is kept between calls."""
    times = np.linspace(-1.0, trajectory.duration_s + 1.0, 301)
    together = trajectory.sample(times)
    for index in range(0, 301, 7):
        alone = trajectory.sample(times[index : index + 1])
        np.testing.assert_allclose(alone.position_in_world[0], together.position_in_world[index], atol=1e-12)
        np.testing.assert_allclose(alone.acceleration_in_world[0], together.acceleration_in_world[index], atol=1e-12)
        assert alone.yaw_rad[0] == pytest.approx(together.yaw_rad[index], abs=1e-12)


def test_it_knows_which_leg_flies(trajectory: MissionTrajectory) -> None:
    """In a transition the leg ahead is named, but no leg flies."""
    spans = trajectory.spans
    assert [span.leg for span in spans if span.is_leg] == list(range(len(LEGS)))
    assert spans[0].start_s == 0.0
    assert spans[-1].end_s == pytest.approx(trajectory.duration_s)
    assert next(span.name for span in spans if span.leg == 1) == "round"
    assert next(span.name for span in spans if span.leg == 0) == "hover"
    for before, after in itertools.pairwise(spans):
        assert before.end_s == after.start_s
    for span in spans:
        middle = 0.5 * (span.start_s + span.end_s)
        assert trajectory.span_at(middle) == span
        assert trajectory.leg_at(middle) == span.leg
        assert trajectory.in_leg(middle) == span.is_leg
    assert trajectory.leg_at(-1.0) == 0
    assert trajectory.leg_at(trajectory.duration_s + 1.0) == len(LEGS) - 1
    assert not trajectory.in_leg(-1.0)
    assert not trajectory.in_leg(trajectory.duration_s + 1.0)


def test_transitions_keep_the_missions_and_the_airframes_limits() -> None:
    """A steep way down is flown at the descent limit, a level one at the transition's speed."""
    transition = {"speed_m_s": 3.0, "acceleration_m_s2": 4.0, "jerk_m_s3": 8.0}
    hover = {"type": "hover", "duration_s": 1.0}
    flight = fly(
        {**hover, "position_m": (0, 0, 40)},
        {**hover, "position_m": (30, 0, 40)},
        {**hover, "position_m": (30, 0, 2)},
        start=np.array((0.0, 0.0, 2.0)),
        transition=transition,
    )
    ways = [span for span in flight.spans if not span.is_leg]
    speeds, accelerations = [], []
    for span in ways:
        reference = flight.sample(np.arange(span.start_s, span.end_s, 0.01))
        speeds.append(peak(reference.velocity_in_world))
        accelerations.append(peak(reference.acceleration_in_world))
    assert speeds == pytest.approx([LIMITS.climb_m_s, 3.0, LIMITS.descent_m_s])
    assert max(accelerations) <= LIMITS.acceleration_m_s2 + 1e-9


def test_the_takeoff_point_is_the_origin_and_can_be_moved() -> None:
    """Points shift with it; points in PX4's local frame do not."""
    origin, other = np.array((10.0, -5.0, 2.0)), np.array((11.0, -5.0, 2.5))
    hover = {"type": "hover", "position_m": (1, 2, 3), "duration_s": 2.0}
    flight = MissionTrajectory(mission(hover), LIMITS, HOME, 0.0, placement=Placement(origin))
    end = np.array((flight.duration_s,))
    np.testing.assert_allclose(flight.sample(np.zeros(1)).position_in_world[0], HOME)
    np.testing.assert_allclose(flight.sample(end).position_in_world[0], origin + np.array((1, 2, 3)))
    moved = flight.reanchored(Placement(other))
    np.testing.assert_allclose(moved.sample(end).position_in_world[0], other + np.array((1, 2, 3)))
    np.testing.assert_allclose(flight.sample(end).position_in_world[0], origin + np.array((1, 2, 3)))
    local = MissionTrajectory(mission(hover, frame="local"), LIMITS, HOME, 0.0, placement=Placement(origin))
    for one in (local, local.reanchored(Placement(other))):
        np.testing.assert_allclose(one.sample(end).position_in_world[0], (1, 2, 3))


@pytest.mark.parametrize("heading", [0.7, -2.9])
def test_a_turned_frame_turns_the_whole_reference_exactly(heading: float) -> None:
    """Positions, derivatives, yaw and the scalar path: those of the mission's own frame, turned and moved."""
    placement = Placement(np.array((10.0, -5.0, 2.0)), heading)
    own = MissionTrajectory(mission(*LEGS), LIMITS, START, 2.5)
    placed = MissionTrajectory(mission(*LEGS), LIMITS, placement.to_world(START), 2.5 + heading, placement)
    cosine, sine = math.cos(heading), math.sin(heading)
    turn = np.array(((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)))
    times = np.linspace(-1.0, own.duration_s + 1.0, 2001)
    expected = own.sample(times)
    for trajectory in (placed, own.reanchored(placement), placed.reanchored(Placement(START)).reanchored(placement)):
        reference = trajectory.sample(times)
        assert trajectory.duration_s == pytest.approx(own.duration_s)
        np.testing.assert_allclose(
            reference.position_in_world, placement.origin + expected.position_in_world @ turn.T, atol=1e-9
        )
        np.testing.assert_allclose(reference.velocity_in_world, expected.velocity_in_world @ turn.T, atol=1e-9)
        np.testing.assert_allclose(reference.acceleration_in_world, expected.acceleration_in_world @ turn.T, atol=1e-9)
        np.testing.assert_allclose(reference.yaw_rad, expected.yaw_rad + heading, atol=1e-9)
        np.testing.assert_allclose(reference.yaw_rate_rad_s, expected.yaw_rate_rad_s, atol=1e-9)
        for index in range(0, 2001, 100):
            np.testing.assert_allclose(
                trajectory.position_at(float(times[index])), reference.position_in_world[index], atol=1e-9
            )


def test_a_placement_takes_points_there_and_back() -> None:
    """The frame's x axis points where its heading says."""
    placement = Placement(np.array((1.0, 2.0, 3.0)), math.pi / 2.0)
    np.testing.assert_allclose(placement.to_world(np.array((4.2, 0.0, 0.2))), (1.0, 6.2, 3.2))
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(placement.from_world(placement.to_world(points)), points, atol=1e-12)


def test_a_leg_that_begins_where_the_vehicle_is_needs_no_transition() -> None:
    """Neither way nor turn."""
    hover = {"type": "hover", "position_m": tuple(HOME), "duration_s": 2.0}
    assert len(fly(hover).spans) == 1
    assert len(fly(hover, start_yaw=4.0 * math.pi).spans) == 1
    assert len(fly(hover, start_yaw=0.1).spans) == 2


def test_arrays_of_a_sample_can_be_handed_to_a_solver(trajectory: MissionTrajectory) -> None:
    """They are contiguous and belong to the caller."""
    times = np.linspace(0.0, 60.0, 41)
    first = trajectory.sample(times)
    for array in (first.position_in_world, first.velocity_in_world, first.acceleration_in_world, first.yaw_rad):
        assert array.flags.c_contiguous
        array[:] = np.nan
    assert np.isfinite(trajectory.sample(times).position_in_world).all()
