"""Motion over corners keeps speed, acceleration and jerk and arrives where it should."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uasfly.trajectories.pieces import PieceTable
from uasfly.trajectories.polyline import chain, move
from uasfly.trajectories.profile import MotionLimits, move_duration

Point = tuple[float, float, float]

coordinate = st.floats(-20.0, 20.0)
point = st.tuples(coordinate, coordinate, coordinate)
limits = st.builds(MotionLimits, st.floats(0.2, 5.0), st.floats(0.2, 20.0))


@given(st.lists(point, min_size=2, max_size=7), st.floats(0.1, 5.0), limits, st.data())
@settings(max_examples=150, deadline=None)
def test_a_chain_keeps_all_limits_and_arrives(
    points: list[Point], speed: float, limit: MotionLimits, data: st.DataObject
) -> None:
    """Any corners, doubled points and turning back included."""
    corners = np.array(points)
    speeds = [speed * data.draw(st.floats(0.2, 1.0)) for _ in corners[1:]]
    table = PieceTable(chain(corners, speeds, limit))
    times = np.linspace(0.0, table.duration_s, 2001)
    position, velocity, acceleration = table.sample(times)
    np.testing.assert_allclose(position[0], corners[0], atol=1e-12)
    np.testing.assert_allclose(position[-1], corners[-1], atol=1e-7)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=1e-7)
    np.testing.assert_allclose(acceleration[[0, -1]], 0.0, atol=1e-7)
    assert np.linalg.norm(velocity, axis=1).max() <= max(speeds) * (1.0 + 1e-9) + 1e-9
    assert np.linalg.norm(acceleration, axis=1).max() <= limit.acceleration * (1.0 + 1e-9) + 1e-9
    if table.duration_s > 0.0:
        jerk = np.diff(acceleration, axis=0) / (times[1] - times[0])
        assert np.linalg.norm(jerk, axis=1).max() <= limit.jerk * (1.0 + 1e-6) + 1e-6


@given(point, point, st.floats(0.1, 5.0), limits)
@settings(max_examples=50, deadline=None)
def test_a_single_move_is_straight_and_as_fast_as_can_be(
    start: Point, end: Point, speed: float, limit: MotionLimits
) -> None:
    """Its duration is that of the seven phases."""
    a, b = np.array(start), np.array(end)
    table = PieceTable(move(a, b, speed, limit))
    distance = float(np.linalg.norm(b - a))
    if distance < 1e-6:
        return
    assert table.duration_s == pytest.approx(move_duration(distance, speed, limit))
    position, _, _ = table.sample(np.linspace(0.0, table.duration_s, 101))
    across = np.cross(position - a, (b - a) / distance)
    np.testing.assert_allclose(across, 0.0, atol=1e-9 * (1.0 + distance))
    assert np.all(np.diff((position - a) @ (b - a)) >= -1e-9)


def test_a_corner_that_changes_nothing_leaves_no_trace() -> None:
    """A point in the middle of a straight line at one speed is as if it were not there."""
    limit = MotionLimits(1.0, 2.0)
    corners = np.array(((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (5.0, 0.0, 0.0), (10.0, 0.0, 0.0)))
    with np.errstate(all="raise"):
        with_point = chain(corners, [1.0, 1.0, 1.0], limit)
    without = chain(np.array(((0.0, 0.0, 0.0), (10.0, 0.0, 0.0))), [1.0], limit)
    times = np.linspace(0.0, without.duration_s, 500)
    for one, other in zip(PieceTable(with_point).sample(times), PieceTable(without).sample(times), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_a_right_angle_is_rounded_and_not_stopped_at() -> None:
    """The speed stays up, the corner is cut by some of the ramp's length."""
    limit = MotionLimits(1.0, 2.0)
    corners = np.array(((0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (5.0, 5.0, 0.0)))
    table = PieceTable(chain(corners, [1.0, 1.0], limit))
    position, velocity, _ = table.sample(np.linspace(0.0, table.duration_s, 2001))
    nearest = np.linalg.norm(position - corners[1], axis=1)
    at_corner = int(nearest.argmin())
    assert 0.1 < nearest[at_corner] < 0.5
    assert np.linalg.norm(velocity[at_corner]) == pytest.approx(np.sqrt(0.5), rel=1e-3)


def test_a_short_side_between_long_ones_is_flown_slower() -> None:
    """Its two ramps fit into it; the others keep their speed."""
    corners = np.array(((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (10.0, 0.2, 0.0), (0.0, 0.2, 0.0)))
    table = PieceTable(chain(corners, [2.0, 2.0, 2.0], MotionLimits(1.0, 2.0)))
    position, velocity, _ = table.sample(np.linspace(0.0, table.duration_s, 5001))
    assert np.abs(velocity[:, 1]).max() < 0.5
    assert velocity[:, 0].max() > 1.5
    assert position[:, 0].max() < 10.0 + 1e-9
