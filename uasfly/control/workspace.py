"""The arrays that a solver backend works on: data of a solve, references and the plan, made once and used in place."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from uasfly.control.problem import Problem
from uasfly.control.qp import Active, SolveStatus
from uasfly.messages import Array
from uasfly.model import INPUTS, PARAMETERS, STATES


class Workspace:
    """Arrays for N intervals.

    Attributes:
        parameters: (11,) of the model (its force is not used). force: (N, 3) m/s^2 over each interval.
        yaw: (N + 1,) rad at the nodes. initial: (8,) state at the start of the plan.
        position, velocity, acceleration: (N + 1, 3) reference motion at the nodes.
        limits: (3,) largest tilt command [rad], least and largest thrust of the references.
        state_reference: (N + 1, 8). input_reference: (N, 3).
        states: (N + 1, 8) and inputs: (N, 3) of the plan. active: (N, 3) its active bounds.
        figures: (4,) of the last iteration: active-set sweeps, interior-point iterations, largest defect, relative gap.
    """

    def __init__(self, problem: Problem) -> None:
        nodes = problem.grid.nodes
        points = (nodes + 1, 3)
        # What is handed in and what is computed from it lie in one block, which is checked in one go.
        given = [(PARAMETERS,), (nodes, 3), (nodes + 1,), (STATES,), points, points, points]
        self._data, views = _block(*given, (nodes + 1, STATES), (nodes, INPUTS))
        self.parameters, self.force, self.yaw, self.initial, self.position, self.velocity, self.acceleration = views[:7]
        self.state_reference, self.input_reference = views[7:]
        self._given = self._data[: sum(view.size for view in views[:7])]
        tilt = float(np.min(np.abs((problem.input_lower[1:], problem.input_upper[1:]))))
        self.limits: Array = np.array((tilt, problem.input_lower[0], problem.input_upper[0]))
        self.states: Array = np.zeros((nodes + 1, STATES))
        self.inputs: Array = np.zeros((nodes, INPUTS))
        self.active: Active = np.zeros((nodes, INPUTS), np.int8)
        self.figures: Array = np.zeros(4)

    def given_is_finite(self) -> bool:
        """Whether all data of a solve are."""
        return math.isfinite(np.add.reduce(self._given))

    def is_finite(self) -> bool:
        """Whether they and the references for states and inputs are."""
        return math.isfinite(np.add.reduce(self._data))


def _block(*shapes: tuple[int, ...]) -> tuple[Array, list[Array]]:
    """Memory for arrays of several shapes, and the arrays."""
    sizes = [math.prod(shape) for shape in shapes]
    memory = np.zeros(sum(sizes))
    parts = np.split(memory, np.cumsum(sizes)[:-1])
    return memory, [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]


class Backend(Protocol):
    """What evaluates references and iterations on a workspace."""

    name: str

    def references(self) -> SolveStatus:
        """Fill `state_reference` and `input_reference` from the other data; CONVERGED or BAD_INPUT."""
        ...

    def iterate(self, elapsed_s: float) -> SolveStatus:
        """One iteration; the plan changes only where the status is CONVERGED or INEXACT.

        Args:
            elapsed_s: > 0 from the plan shifted by so much, 0 from the plan as it is, < 0 from the references.
        """
        ...
