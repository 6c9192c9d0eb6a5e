"""Real-time iteration: one Newton-like step a sample, from the last plan moved along by the clock.

M. Diehl et al., Real-time optimization and nonlinear model predictive control of processes governed by
differential-algebraic equations, J. Process Control 12 (2002).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.control.compiled import CompiledBackend
from uasfly.control.problem import Problem
from uasfly.control.qp import QpOptions, SolveStatus
from uasfly.control.virtual_machine import VirtualMachineBackend
from uasfly.control.workspace import Backend, Workspace
from uasfly.messages import Array
from uasfly.native import NativeUnavailableError

COLD_ITERATIONS = 3
LONGEST_SHIFT_S = 0.5  # an older plan is no better a start than the references


@dataclass(frozen=True, slots=True)
class SolveFigures:
    """What the last iteration took: active-set sweeps, interior-point iterations, largest defect of the guess."""

    sweeps: int
    interior_iterations: int
    largest_defect: float


def make_backend(
    problem: Problem, workspace: Workspace, choice: str = "auto", options: QpOptions | None = None
) -> tuple[Backend, str]:
    """A backend and what there is to say about the choice ("" for nothing).

    Args:
        problem: the optimal control problem.
        workspace: the arrays that the backend works on.
        choice: "c", "vm", or "auto": compiled where that works, else the virtual machine, with the reason in the text.
        options: limits and tolerances of the quadratic program.

    Raises:
        NativeUnavailableError: with "c" where it is not to be had.
        ValueError: for another choice.
    """
    if choice == "vm":
        return VirtualMachineBackend(problem, workspace, options), ""
    if choice not in ("auto", "c"):
        raise ValueError(f'the backend must be "auto", "c" or "vm", found {choice!r}')
    try:
        return CompiledBackend(problem, workspace, options), ""
    except NativeUnavailableError as reason:
        if choice == "c":
            raise
        text = f"solver runs in CasADi's virtual machine, about seven times slower than compiled: {reason}"
        return VirtualMachineBackend(problem, workspace, options), text


class RealTimeIteration:
    """The problem, its plan and the clock.

    Before `solve`, fill the data of `workspace`: parameters, force, yaw, initial state and reference motion. A solve
    that fails leaves the plan and its time as they were.

    Attributes:
        problem: what is solved. workspace: data and plan. backend: what solves it.
        announcement: why the compiled backend is not used, "" where it is.
        plan_start_s: time of the plan's first node, None while there is no plan.
    """

    def __init__(self, problem: Problem, backend: str = "auto", options: QpOptions | None = None) -> None:
        self.problem = problem
        self.workspace = Workspace(problem)
        self.backend, self.announcement = make_backend(problem, self.workspace, backend, options)
        self.plan_start_s: float | None = None
        self._first = self.workspace.input_reference[0]
        self._move_share = problem.move_share

    def solve(self, start_s: float, iterations: int = 1, before: Array | None = None) -> SolveStatus:
        """Plan from `start_s` on [s]; on a cold start at least three iterations.

        Args:
            start_s: time of the plan's first node.
            iterations: how many.
            before: (3,) inputs commanded until then; without them the first input is as free as any.
        """
        if not math.isfinite(start_s):
            return SolveStatus.BAD_INPUT
        status = self.backend.references()
        if status is not SolveStatus.CONVERGED:
            return status
        if before is not None:
            self._first += self._move_share * (before - self._first)  # see `Problem.move_share`
        elapsed = -1.0
        if self.plan_start_s is not None and 0.0 <= start_s - self.plan_start_s <= LONGEST_SHIFT_S:
            elapsed = start_s - self.plan_start_s
        else:
            iterations = max(iterations, COLD_ITERATIONS)
        for _ in range(iterations):
            status = self.backend.iterate(elapsed)
            if status in (SolveStatus.FAILED, SolveStatus.BAD_INPUT):
                return status
            self.plan_start_s, elapsed = start_s, 0.0
        return status

    def planned_inputs(self, time_s: float) -> Array | None:
        """Inputs (3,) that the plan holds for a time [s]; None without a plan or outside of it."""
        if self.plan_start_s is None:
            return None
        age = time_s - self.plan_start_s
        if not -1e-9 <= age <= self.problem.grid.time_s[-1]:
            return None
        planned: Array = self.workspace.inputs[self.problem.grid.interval_at(age)].copy()
        return planned

    def drop_plan(self) -> None:
        """Start cold at the next solve."""
        self.plan_start_s = None

    @property
    def figures(self) -> SolveFigures:
        """Of the last iteration."""
        figures = self.workspace.figures
        return SolveFigures(int(figures[0]), int(figures[1]), float(figures[2]))
