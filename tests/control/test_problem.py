"""The optimal control problem as numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.airframe import Airframe, Weights
from uasfly.control.grid import Grid
from uasfly.control.problem import Problem, problem_from_airframe, problem_from_weights


def test_stage_weights_add_up_to_the_horizon(airframe: Airframe) -> None:
    """However the grid is spaced, the stage weights integrate to the weight times the horizon."""
    problem = problem_from_airframe(airframe)
    weights = airframe.controller.weights
    terminal = weights.terminal * np.array((*weights.position, *weights.velocity, *weights.tilt))
    per_second = (problem.state_weights.sum(axis=0) - terminal) / 3.0
    np.testing.assert_allclose(per_second, (*weights.position, *weights.velocity, *weights.tilt))
    np.testing.assert_allclose(problem.input_weights.sum(axis=0) / 3.0, (weights.thrust, weights.roll, weights.pitch))


def test_bounds_are_the_airframes_limits(airframe: Airframe) -> None:
    """Thrust, roll and pitch are bounded as the file says, in the order of the model's inputs."""
    problem = problem_from_airframe(airframe)
    tilt = math.radians(30.0)
    np.testing.assert_allclose(problem.input_lower, (0.15, -tilt, -tilt))
    np.testing.assert_allclose(problem.input_upper, (0.75, tilt, tilt))


def test_bounds_without_room_and_weights_of_zero_are_refused(airframe: Airframe) -> None:
    """A problem that the solver could not solve is not made."""
    grid = Grid.from_intervals(np.full(5, 0.1))
    weights = airframe.controller.weights
    with pytest.raises(ValueError, match="leave room"):
        problem_from_weights(grid, weights, np.zeros(3), np.zeros(3))
    good = problem_from_weights(grid, weights, -np.ones(3), np.ones(3))
    with pytest.raises(ValueError, match="positive"):
        Problem(grid, good.state_weights, 0.0 * good.input_weights, good.input_lower, good.input_upper)


def test_the_terminal_weight_is_a_multiple_of_the_stage_weights() -> None:
    """With terminal 7 the last node weighs 7 times the stage weight more than half its interval."""
    weights = Weights(position=(2, 3, 4), velocity=(5, 6, 7), tilt=(8, 9), roll=1, pitch=1, thrust=1, terminal=7)
    problem = problem_from_weights(Grid.from_intervals(np.full(5, 0.1)), weights, -np.ones(3), np.ones(3))
    np.testing.assert_allclose(problem.state_weights[-1], 7.05 * np.arange(2.0, 10.0))


def test_a_step_of_the_first_input_costs_what_the_problem_says() -> None:
    """The blended reference has the gradient of both terms: the stage's and that of the step from the last command."""
    weights = Weights(
        position=(2, 3, 4), velocity=(5, 6, 7), tilt=(8, 9), roll=3, pitch=4, thrust=5, terminal=7, move=1.5
    )
    problem = problem_from_weights(Grid.from_intervals(np.full(5, 0.1)), weights, -np.ones(3), np.ones(3))
    stage = 0.1 * np.array((5.0, 3.0, 4.0))
    np.testing.assert_allclose(problem.move_weights, 1.5 * stage)
    np.testing.assert_allclose(problem.input_weights[1], stage)
    inputs, reference, before = np.array((0.4, 0.1, -0.2)), np.array((0.3, 0.0, 0.1)), np.array((0.5, -0.1, 0.3))
    blended = reference + problem.move_share * (before - reference)
    np.testing.assert_allclose(
        problem.input_weights[0] * (inputs - blended),
        stage * (inputs - reference) + 1.5 * stage * (inputs - before),
    )
