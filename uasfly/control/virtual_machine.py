"""The backend that needs no compiler: stage functions in CasADi's virtual machine, the rest in numpy."""

from __future__ import annotations

import math

import numpy as np

from uasfly.control.grid import Shift
from uasfly.control.problem import Problem
from uasfly.control.qp import QpOptions, QpSolver, SolveStatus, StageQp
from uasfly.control.qp_riccati import RiccatiQp
from uasfly.control.references import input_reference_function, trim_function
from uasfly.control.riccati_machine import machine_functions
from uasfly.control.stagewise import Stagewise
from uasfly.control.transcription import linearisation_function
from uasfly.control.workspace import Workspace
from uasfly.model import INPUTS, STATES


class VirtualMachineBackend:
    """Backend on a workspace; any QpSolver can take the place of the tailored one."""

    name = "vm"

    def __init__(
        self, problem: Problem, workspace: Workspace, options: QpOptions | None = None, qp: QpSolver | None = None
    ) -> None:
        work, nodes = workspace, problem.grid.nodes
        linearise, pattern = linearisation_function()
        self._problem, self._workspace = problem, workspace
        self._qp: QpSolver = qp or RiccatiQp(machine_functions(pattern), pattern.size, nodes, options)
        self._shift: tuple[float, Shift] = (0.0, Shift.after(problem.grid, 0.0))

        self._lower, self._upper = (np.tile(bound, (nodes, 1)) for bound in (problem.input_lower, problem.input_upper))

        # Where the plan is linearised, and what comes of it.
        self._states, self._inputs = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        self._defect, self._jacobian = np.zeros((nodes, STATES)), np.zeros((nodes, pattern.size))
        interval, self._yaw_rate = problem.grid.interval_s[:, None], np.zeros((nodes, 1))
        self._linearise = Stagewise(
            linearise,
            [
                *(self._states[:-1], self._inputs, work.parameters, work.force),
                *(work.yaw[:-1, None], self._yaw_rate, interval, self._states[1:]),
            ],
            [self._defect, self._jacobian],
        )
        self._trims, self._force_at_nodes = np.zeros((nodes + 1, 3)), np.zeros((nodes + 1, 3))
        self._trim = Stagewise(
            trim_function(),
            [
                *(work.acceleration, work.velocity, work.yaw[:, None]),
                *(self._force_at_nodes, work.parameters, work.limits),
            ],
            [self._trims],
        )
        self._input_reference = Stagewise(
            input_reference_function(),
            [
                *(self._trims[:-1], self._trims[1:], work.parameters),
                *(interval, problem.input_lower, problem.input_upper),
            ],
            [work.input_reference],
        )

    def references(self) -> SolveStatus:
        """See `Backend.references`."""
        work = self._workspace
        if not work.given_is_finite():
            return SolveStatus.BAD_INPUT
        self._force_at_nodes[:-1], self._force_at_nodes[-1] = work.force, work.force[-1]
        self._trim.forward()
        self._input_reference.forward()
        work.state_reference[:, :3], work.state_reference[:, 3:6] = work.position, work.velocity
        work.state_reference[:, 6:] = self._trims[:, :2]
        return SolveStatus.CONVERGED

    def iterate(self, elapsed_s: float) -> SolveStatus:
        """See `Backend.iterate`."""
        work, states, inputs = self._workspace, self._states, self._inputs
        if not (math.isfinite(elapsed_s) and work.given_is_finite() and work.references_are_finite()):
            return SolveStatus.BAD_INPUT
        if elapsed_s > 0.0:
            if elapsed_s != self._shift[0]:
                self._shift = (elapsed_s, Shift.after(self._problem.grid, elapsed_s))
            shift = self._shift[1]
            states[:], inputs[:] = shift.states(work.states), shift.inputs(work.inputs)
            active = work.active[shift.nearest]
        elif elapsed_s == 0.0:
            states[:], inputs[:], active = work.states, work.inputs, work.active
        else:
            states[:], inputs[:], active = work.state_reference, work.input_reference, np.zeros_like(work.active)
        states[0] = work.initial
        qp = self._quadratic_program()
        solution = self._qp.solve(qp, active)
        work.figures[:3] = solution.sweeps, solution.interior_iterations, np.abs(qp.defect).max()
        if solution.status is SolveStatus.FAILED:
            return SolveStatus.FAILED
        np.add(states, solution.states, out=work.states)
        np.maximum(inputs + solution.inputs, self._lower, out=work.inputs)
        np.minimum(work.inputs, self._upper, out=work.inputs)
        work.active[:] = solution.active
        return solution.status

    def _quadratic_program(self) -> StageQp:
        work, problem, states, inputs = self._workspace, self._problem, self._states, self._inputs
        self._yaw_rate[:, 0] = (work.yaw[1:] - work.yaw[:-1]) / problem.grid.interval_s
        self._linearise.forward()
        return StageQp(
            jacobian=self._jacobian,
            defect=self._defect,
            initial=work.initial - states[0],
            state_gradient=problem.state_weights * (states - work.state_reference),
            input_gradient=problem.input_weights * (inputs - work.input_reference),
            state_weights=problem.state_weights,
            input_weights=problem.input_weights,
            lower=self._lower - inputs,
            upper=self._upper - inputs,
        )
