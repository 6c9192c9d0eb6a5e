"""Yaw follows its rule, never jumps, and never turns faster than allowed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trajectories.motion import LIMITS, assert_consistent, fly, leg_samples
from uasfly.frames import wrap_angle
from uasfly.messages import ReferenceHorizon
from uasfly.trajectories.trajectory import Trajectory
from uasfly.trajectories.yaw import nearest_turn, turn_time_s

RATE = LIMITS.yaw_rate_rad_s
TRACK = {"type": "back_and_forth", "start_m": (-1, 0, 1.5), "end_m": (1, 0, 1.5), "speed_m_s": 0.4, "passes": 3}
CIRCLE = {"type": "circle", "center_m": (0, 0), "radius_m": 2.0, "height_m": 1.5, "speed_m_s": 0.5, "turns": 2.0}


def every(trajectory: Trajectory, step_s: float = 0.005) -> ReferenceHorizon:
    """The whole trajectory."""
    return trajectory.sample(np.arange(0.0, trajectory.duration_s + step_s, step_s))


def assert_bounded(trajectory: Trajectory) -> None:
    """No jump, no turn faster than the airframe allows."""
    reference = every(trajectory)
    assert np.abs(reference.yaw_rate_rad_s).max() <= RATE * (1.0 + 1e-6)
    assert np.abs(np.diff(reference.yaw_rad)).max() <= RATE * 0.005 * (1.0 + 1e-6)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_the_nearest_equivalent_angle_is_within_half_a_turn(yaw: float, reference: float) -> None:
    """And it is the same heading."""
    near = nearest_turn(yaw, reference)
    assert abs(near - reference) <= math.pi + 1e-9
    assert wrap_angle(near - yaw) == pytest.approx(0.0, abs=1e-9)


def test_a_fixed_yaw_is_reached_the_short_way() -> None:
    """From 170 degrees to -170 it turns 20 degrees through 180, unwrapped."""
    hover = {"type": "hover", "position_m": (0, 0, 1.5), "duration_s": 5.0}
    trajectory = fly(hover, start_yaw=math.radians(170.0), yaw={"rule": "fixed", "yaw_deg": -170.0})
    yaw = every(trajectory).yaw_rad
    assert (yaw[0], yaw[-1]) == pytest.approx((math.radians(170.0), math.radians(190.0)))
    assert np.all(np.diff(yaw) >= -1e-12)
    assert trajectory.spans[0].end_s == pytest.approx(turn_time_s(math.radians(20.0), RATE))
    assert not trajectory.spans[0].is_leg


def test_facing_a_point_points_at_it_all_along() -> None:
    """Within a hundredth of a degree, through all turns."""
    trajectory = fly(CIRCLE, yaw={"rule": "facing", "point_m": (0.5, -0.3)})
    reference = leg_samples(trajectory, 0)
    to_point = np.array((0.5, -0.3)) - reference.position_in_world[:, :2]
    expected = np.unwrap(np.arctan2(to_point[:, 1], to_point[:, 0]))
    error = reference.yaw_rad - expected
    np.testing.assert_allclose(error - 2.0 * math.pi * np.round(error[0] / (2.0 * math.pi)), 0.0, atol=2e-4)
    assert reference.yaw_rad[-1] - reference.yaw_rad[0] == pytest.approx(4.0 * math.pi, abs=1e-3)
    assert_bounded(trajectory)
    assert_consistent(trajectory, jerk=2.0)


def test_yaw_along_the_path_is_its_tangent() -> None:
    """On a circle it turns with it."""
    trajectory = fly({**CIRCLE, "direction": "clockwise"}, yaw={"rule": "path"})
    reference = leg_samples(trajectory, 0)
    vx, vy, _ = reference.velocity_in_world[5:-5].T
    off = [wrap_angle(angle) for angle in reference.yaw_rad[5:-5] - np.arctan2(vy, vx)]
    np.testing.assert_allclose(off, 0.0, atol=2e-4)
    assert_bounded(trajectory)


def test_along_a_track_the_nose_turns_round_during_the_stop() -> None:
    """A stop too short for the turn grows; without the path rule it stays as asked."""
    turning, straight = fly({**TRACK, "stop_s": 1.0}, yaw={"rule": "path"}), fly({**TRACK, "stop_s": 1.0})
    needed = turn_time_s(math.pi, RATE)
    assert needed > 1.0
    lengths = [span.end_s - span.start_s for t in (turning, straight) for span in t.spans if span.is_leg]
    assert lengths[0] - lengths[1] == pytest.approx(4.0 * (needed - 1.0))
    reference = leg_samples(turning, 0)
    moving = np.abs(reference.velocity_in_world[:, 0]) > 1e-3
    forward = np.sign(reference.velocity_in_world[moving, 0])
    np.testing.assert_allclose(np.cos(reference.yaw_rad[moving]), forward, atol=1e-4)
    assert_bounded(turning)


def test_a_rule_that_says_nothing_keeps_the_heading() -> None:
    """Hovering has no path; a point straight below has no direction."""
    hover = {"type": "hover", "position_m": (1, 1, 1.5), "duration_s": 3.0}
    for rule in ({"rule": "path"}, {"rule": "facing", "point_m": (1, 1)}):
        reference = every(fly(hover, start_yaw=1.2, yaw=rule))
        np.testing.assert_allclose(reference.yaw_rad, 1.2, atol=1e-12)


def test_a_point_on_the_way_is_faced_as_fast_as_allowed() -> None:
    """Flying over it asks for a turn at once: the rate stays bounded, the asking is told."""
    trajectory = fly({**TRACK, "stop_s": 3.0}, yaw={"rule": "facing", "point_m": (0.0, 0.0)})
    (span,) = (span for span in trajectory.spans if span.is_leg)
    assert span.asked_yaw_rate_rad_s > 2.0 * RATE
    assert_bounded(trajectory)
    first, last = leg_samples(trajectory, 0).yaw_rad[[0, -1]]
    assert abs(wrap_angle(first - 0.0)) < 1e-6
    assert abs(wrap_angle(last - math.pi)) < 1e-6


def test_transitions_wait_for_the_turn() -> None:
    """A short way with a long turn takes the turn's time, and the leg begins with its heading."""
    trajectory = fly(
        {"type": "hover", "position_m": (0, 0, 1.5), "duration_s": 1.0},
        {"type": "hover", "position_m": (0.1, 0, 1.5), "duration_s": 1.0, "yaw": {"rule": "fixed", "yaw_deg": 179.0}},
    )
    way = trajectory.spans[1]
    assert way.end_s - way.start_s == pytest.approx(turn_time_s(math.radians(179.0), RATE))
    leg = leg_samples(trajectory, 1)
    np.testing.assert_allclose(leg.yaw_rad, math.radians(179.0), atol=1e-12)
    assert_bounded(trajectory)
    assert_consistent(trajectory, jerk=2.0)
