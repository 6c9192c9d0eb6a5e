"""What the solver is measured on: sizes, and boxes that bind next to never or in a sixth of the plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.airframe import Airframe
from uasfly.control.grid import Grid, geometric_intervals
from uasfly.control.problem import Problem, problem_from_weights

NODES = (10, 20, 30, 40, 60, 80, 120, 160)
HORIZON_S = 3.0
SATURATED_SHARE = (0.15, 0.20)  # of the plan's inputs at a bound


def most_nodes() -> int:
    """The largest size that can be measured."""
    return NODES[-1]


@dataclass(frozen=True, slots=True)
class Case:
    """How far off an episode starts.

    Attributes:
        name: as told. start_m: largest distance to the reference. start_m_s: largest difference of each velocity.
        start_rad: largest roll and pitch.
    """

    name: str
    start_m: float
    start_m_s: float
    start_rad: float


NOMINAL = Case("nominal", 0.1, 0.2, math.radians(3.0))
SATURATED = Case("saturated", 2.0, 0.5, math.radians(3.0))
CASES = (NOMINAL, SATURATED)


def bench_grid(airframe: Airframe, nodes: int) -> Grid:
    """Grid of so many nodes over 3 s, that starts with the airframe's first interval where that leaves room."""
    first = min(airframe.controller.first_interval_s, HORIZON_S / nodes)
    return Grid.from_intervals(geometric_intervals(HORIZON_S, nodes, first))


def bench_problem(airframe: Airframe, nodes: int, box: float = 1.0) -> Problem:
    """The airframe's problem on a grid; `box` shrinks its input bounds towards hover, 1 leaves them."""
    limits, hover = airframe.limits, airframe.model.hover_thrust
    tilt = box * limits.tilt_rad
    lower = np.array((hover - box * (hover - limits.thrust_min), -tilt, -tilt))
    upper = np.array((hover + box * (limits.thrust_max - hover), tilt, tilt))
    return problem_from_weights(bench_grid(airframe, nodes), airframe.controller.weights, lower, upper)
