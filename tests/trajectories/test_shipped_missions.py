"""The shipped missions are the paper's where they carry its names, and every shipped airframe can fly every one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.trajectories.motion import HOME, assert_consistent
from uasfly.airframe import Airframe
from uasfly.files import find_file, load_file, shipped_names
from uasfly.mission import Mission
from uasfly.trajectories.feasibility import check_mission
from uasfly.trajectories.mission_trajectory import MissionTrajectory
from uasfly.trajectories.placement import Placement

AIRFRAMES = ("aurelia_x6", "f550", "iris", "px4_sih")
MISSIONS = (
    "back_and_forth",
    "circle",
    "drag",
    "figure_eight",
    "hover",
    "line",
    "marker_hover",
    "marker_standoff",
    "spiral",
    "waypoints",
)


def load(name: str) -> Mission:
    """A shipped mission."""
    return load_file(find_file("mission", name), Mission)


def test_these_missions_are_shipped() -> None:
    """Neither more nor less than the documentation says."""
    assert sorted(shipped_names("mission")) == sorted(MISSIONS)


@pytest.mark.parametrize("name", MISSIONS)
def test_every_airframe_can_fly_it_in_the_wind_it_is_made_for(name: str) -> None:
    """Without an error and without a warning."""
    mission = load(name)
    assert mission.name == name
    for airframe in AIRFRAMES:
        assert check_mission(mission, load_file(find_file("airframe", airframe), Airframe)) == [], airframe


@pytest.mark.parametrize("name", MISSIONS)
def test_its_reference_is_smooth(name: str) -> None:
    """On the f550, from a start that is not quite where the mission thinks."""
    limits = load_file(find_file("airframe", "f550"), Airframe).limits
    trajectory = MissionTrajectory(load(name), limits, HOME + np.array((0.1, -0.1, 0.05)), 0.3)
    assert_consistent(trajectory, jerk=2.0, step_s=0.005)


def test_the_missions_with_markers_have_the_papers_figures() -> None:
    """137 s over the floor; 4.2 m off the board and 0.2 m above its centre, looking at it."""
    limits = load_file(find_file("airframe", "aurelia_x6"), Airframe).limits
    over = MissionTrajectory(load("marker_hover"), limits, HOME, 0.0)
    assert over.spans[-1].end_s - over.spans[-1].start_s == pytest.approx(137.0)
    board = Placement(np.array((5.0, 3.0, 1.6)), -2.0)  # which looks there
    off = MissionTrajectory(load("marker_standoff"), limits, HOME, 0.3, board)
    assert off.spans[-1].end_s - off.spans[-1].start_s == pytest.approx(120.0)
    end = off.sample(np.array((off.duration_s,)))
    ahead = np.array((np.cos(-2.0), np.sin(-2.0), 0.0))
    np.testing.assert_allclose(end.position_in_world[0], board.origin + 4.2 * ahead + (0.0, 0.0, 0.2), atol=1e-9)
    nose = np.array((np.cos(end.yaw_rad[0]), np.sin(end.yaw_rad[0]), 0.0))
    np.testing.assert_allclose(nose, -ahead, atol=1e-6)


def test_the_missions_of_the_paper_have_its_figures() -> None:
    """Hover as long as the blower's programme, a track of 2 m within 120 s, a spiral of 120 s seen from (1, 0)."""
    limits = load_file(find_file("airframe", "f550"), Airframe).limits
    legs = {}
    for name in ("hover", "back_and_forth", "spiral"):
        trajectory = MissionTrajectory(load(name), limits, HOME, 0.0)
        (span,) = (span for span in trajectory.spans if span.is_leg)
        legs[name] = (span.end_s - span.start_s, trajectory.sample(np.linspace(span.start_s, span.end_s, 5000)))
    duration, hover = legs["hover"]
    assert duration == pytest.approx(105.0)
    np.testing.assert_allclose(hover.position_in_world, np.tile(HOME, (5000, 1)))
    duration, track = legs["back_and_forth"]
    assert 110.0 < duration <= 120.0
    assert np.ptp(track.position_in_world, axis=0) == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)
    duration, spiral = legs["spiral"]
    assert duration == pytest.approx(120.0)
    assert spiral.position_in_world[0] == pytest.approx((1.0, 0.0, 0.75))
    assert spiral.position_in_world[-1] == pytest.approx((1.0, 0.0, 2.25))
    toward_center = -spiral.position_in_world[:, :2] / np.linalg.norm(spiral.position_in_world[:, :2], axis=1)[:, None]
    nose = np.stack((np.cos(spiral.yaw_rad), np.sin(spiral.yaw_rad)), axis=1)
    np.testing.assert_allclose(nose, toward_center, atol=1e-3)
