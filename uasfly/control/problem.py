"""The optimal control problem (Kalaitzakis 2023, eq. 10) as numbers: grid, weights and bounds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from uasfly.airframe import Airframe, Weights
from uasfly.control.grid import Grid, geometric_intervals
from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class Problem:
    """Least squares over a grid, inputs in a box; the order of states and inputs is that of `uasfly.model`.

    minimise  1/2 sum_k |x_k - xref_k|^2_Q_k + 1/2 sum_k |u_k - uref_k|^2_R_k  over k = 0..N (states), 0..N-1 (inputs)
              + 1/2 |u_0 - u_before|^2_M

    The last term is not the paper's. Without it the first input follows every bit of noise in the velocity, and jumps
    between its bounds where wind takes all that tilt and thrust can give.

    Attributes:
        grid: node times.
        state_weights: (N + 1, 8) diagonals of Q_k: the stage weight times the trapezoidal share of the node, and at the
            last node the terminal weight on top.
        input_weights: (N, 3) diagonals of R_k: the stage weight times the length of the interval.
        input_lower, input_upper: (3,) bounds of thrust, roll_d, pitch_d.
        move_weights: (3,) diagonal of M; R_0 holds it already, see `move_share`.
    """

    grid: Grid
    state_weights: Array
    input_weights: Array
    input_lower: Array
    input_upper: Array
    move_weights: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def move_share(self) -> Array:
        """Share (3,) of M in R_0.

        A reference for u_0 that lies so far on the way to the inputs before stands, weighed with R_0, for the paper's
        term and for that of M.
        """
        share: Array = self.move_weights / self.input_weights[0]
        return share

    def __post_init__(self) -> None:
        if not np.all(self.input_lower < self.input_upper):
            raise ValueError(f"input bounds must leave room, found {self.input_lower} .. {self.input_upper}")
        if not np.all(self.input_weights > 0.0):
            raise ValueError("input weights must be positive")


def problem_from_weights(grid: Grid, weights: Weights, input_lower: Array, input_upper: Array) -> Problem:
    """Problem on a grid from the stage weights of an airframe file and bounds (3,) of thrust, roll_d, pitch_d."""
    stage_state = np.array((*weights.position, *weights.velocity, *weights.tilt))
    stage_input = np.array((weights.thrust, weights.roll, weights.pitch))
    half = 0.5 * grid.interval_s
    share = np.zeros(grid.nodes + 1)
    share[:-1] += half
    share[1:] += half
    state_weights = np.outer(share, stage_state)
    state_weights[-1] += weights.terminal * stage_state
    input_weights = np.outer(grid.interval_s, stage_input)
    move = weights.move * input_weights[0]
    input_weights[0] += move
    return Problem(grid, state_weights, input_weights, np.array(input_lower, float), np.array(input_upper, float), move)


def problem_from_airframe(airframe: Airframe) -> Problem:
    """The problem that an airframe file states."""
    settings, limits = airframe.controller, airframe.limits
    intervals = geometric_intervals(settings.horizon_s, settings.nodes, settings.first_interval_s)
    tilt = limits.tilt_rad
    return problem_from_weights(
        Grid.from_intervals(intervals),
        settings.weights,
        np.array((limits.thrust_min, -tilt, -tilt)),
        np.array((limits.thrust_max, tilt, tilt)),
    )
