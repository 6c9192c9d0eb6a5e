"""The time grid and how a plan moves along it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uasfly.control.grid import Grid, Shift, geometric_intervals


@given(horizon=st.floats(0.5, 10.0), nodes=st.integers(1, 160), share=st.floats(0.01, 1.0, exclude_min=True))
@settings(max_examples=60, deadline=None)
def test_intervals_fill_the_horizon_and_grow_by_one_ratio(horizon: float, nodes: int, share: float) -> None:
    """The intervals add up to the horizon, start as asked and grow by a constant ratio."""
    first = share * horizon / nodes
    intervals = geometric_intervals(horizon, nodes, first)
    assert intervals.shape == (nodes,)
    assert np.sum(intervals) == pytest.approx(horizon, rel=1e-12)
    if nodes > 1:
        assert intervals[0] == pytest.approx(first, rel=1e-6)
        ratios = intervals[1:] / intervals[:-1]
        np.testing.assert_allclose(ratios, ratios[0], rtol=1e-6)
        assert ratios[0] >= 1.0 - 1e-9


def test_a_grid_that_would_have_to_shrink_is_refused() -> None:
    """First intervals that overfill the horizon raise, naming the numbers."""
    with pytest.raises(ValueError, match=r"0\.2 \* 25"):
        geometric_intervals(3.0, 25, 0.2)


@pytest.fixture
def grid() -> Grid:
    """The grid of the f550."""
    return Grid.from_intervals(geometric_intervals(3.0, 25, 0.02))


def test_an_interval_holds_its_start_and_not_its_end(grid: Grid) -> None:
    """A time on a node belongs to the interval that begins there; outside, the ends hold."""
    assert [grid.interval_at(t) for t in grid.time_s[:-1]] == list(range(25))
    assert grid.interval_at(-1.0) == 0
    assert grid.interval_at(99.0) == 24


def test_no_shift_changes_nothing(grid: Grid) -> None:
    """Seen from its own start a plan is itself."""
    rng = np.random.default_rng(1)
    states, inputs = rng.normal(size=(26, 8)), rng.normal(size=(25, 3))
    shift = Shift.after(grid, 0.0)
    np.testing.assert_allclose(shift.states(states), states, atol=1e-13)
    np.testing.assert_allclose(shift.inputs(inputs), inputs, atol=1e-13)
    np.testing.assert_array_equal(shift.nearest, np.arange(25))


@pytest.mark.parametrize("elapsed", [0.003, 0.02, 0.047, 0.5, 2.9])
def test_states_between_nodes_lie_on_the_line_and_hold_beyond_the_end(grid: Grid, elapsed: float) -> None:
    """A plan that is linear in time is moved exactly; after its end it stands still."""
    plan = np.outer(grid.time_s, (1.0, -2.0)) + 3.0
    moved = Shift.after(grid, elapsed).states(plan)
    expected = np.outer(np.minimum(grid.time_s + elapsed, 3.0), (1.0, -2.0)) + 3.0
    np.testing.assert_allclose(moved, expected, atol=1e-12)


@pytest.mark.parametrize("elapsed", [0.003, 0.02, 0.047, 0.5, 2.9])
def test_moved_inputs_keep_their_impulse(grid: Grid, elapsed: float) -> None:
    """Each new input times its interval is the integral of the old ones over it, the last one held beyond the end."""
    inputs = np.random.default_rng(2).normal(size=(25, 3))
    moved = Shift.after(grid, elapsed).inputs(inputs)
    within = grid.time_s[1:] + elapsed <= 3.0
    fine = np.linspace(0.0, 1.0, 4001)[:-1] + 0.5 / 4000
    for k in np.flatnonzero(within):
        times = elapsed + grid.time_s[k] + fine * grid.interval_s[k]
        places = np.clip(np.searchsorted(grid.time_s, times, side="right") - 1, 0, 24)
        np.testing.assert_allclose(moved[k], inputs[places].mean(axis=0), atol=2e-3)
    assert np.all(moved <= inputs.max(axis=0) + 1e-12)
    assert np.all(moved >= inputs.min(axis=0) - 1e-12)


def test_a_plan_that_is_over_holds_its_end(grid: Grid) -> None:
    """Moved by more than the horizon, every node is the last one."""
    states = np.random.default_rng(3).normal(size=(26, 8))
    inputs = np.random.default_rng(4).normal(size=(25, 3))
    shift = Shift.after(grid, 4.0)
    np.testing.assert_allclose(shift.states(states), np.tile(states[-1], (26, 1)))
    np.testing.assert_allclose(shift.inputs(inputs), np.tile(inputs[-1], (25, 1)))


def test_active_bounds_come_from_the_middle_of_the_new_interval(grid: Grid) -> None:
    """After the first interval has passed, the first bounds are those of the second."""
    assert Shift.after(grid, 0.02).nearest[0] == 1
    assert Shift.after(grid, 0.001).nearest[0] == 0
