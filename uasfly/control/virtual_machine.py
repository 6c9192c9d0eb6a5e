"""The backend that needs no compiler: stage functions in CasADi's virtual machine, the rest in numpy."""

from __future__ import annotations

import math

import numpy as np

from uasfly.control.grid import Shift
from uasfly.control.problem import Problem
from uasfly.control.qp import QpOptions, QpSolver, SolveStatus, StageQp
from uasfly.control.qp_riccati import RiccatiQp
from uasfly.control.references import reference_stage_function
from uasfly.control.riccati_machine import machine_functions
from uasfly.control.stagewise import Stagewise
from uasfly.control.transcription import linearisation_function
from uasfly.control.workspace import Workspace
from uasfly.messages import Array
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
        self._qp: QpSolver
        if qp is None:
            tailored = RiccatiQp(machine_functions(pattern), pattern.size, nodes, options)
            self._qp, self._program = tailored, tailored.program
        else:
            self._qp, self._program = qp, StageQp.zeros(nodes, pattern.size)
        self._program.state_weights[:], self._program.input_weights[:] = problem.state_weights, problem.input_weights
        self._shift: tuple[float, Shift] = (0.0, Shift.after(problem.grid, 0.0))

        self._lower, self._upper = (np.tile(bound, (nodes, 1)) for bound in (problem.input_lower, problem.input_upper))

        # Where the plan is linearised.
        self._states, self._inputs = np.zeros((nodes + 1, STATES)), np.zeros((nodes, INPUTS))
        interval, self._yaw_rate = problem.grid.interval_s[:, None], np.zeros(nodes)
        self._linearise = Stagewise(
            linearise,
            [
                *(self._states[:-1], self._inputs, work.parameters, work.force),
                *(work.yaw[:-1, None], self._yaw_rate[:, None], interval, self._states[1:]),
            ],
            [self._program.defect, self._program.jacobian],
        )
        # A trim is handed on from the end to the start; at the end there is no interval, and so no input reference.
        trims, none = np.zeros((nodes + 2, 3)), np.zeros((1, INPUTS))

        def references(at: slice, force: Array, interval: Array, inputs: Array) -> Stagewise:
            after = slice(at.start + 1, at.stop + 1)
            motion = [work.acceleration[at], work.velocity[at], work.position[at], work.yaw[at, None]]
            limits = [work.limits, interval, problem.input_lower, problem.input_upper]
            return Stagewise(
                reference_stage_function(),
                [trims[after], *motion, force, work.parameters, *limits],
                [trims[at], work.state_reference[at], inputs],
            )

        self._last_reference = references(slice(nodes, nodes + 1), work.force[-1:], interval[-1:], none)
        self._references = references(slice(0, nodes), work.force, interval, work.input_reference)

    def references(self) -> SolveStatus:
        """See `Backend.references`."""
        work = self._workspace
        if not work.given_is_finite():
            return SolveStatus.BAD_INPUT
        self._last_reference.forward()
        self._references.backward()
        return SolveStatus.CONVERGED

    def iterate(self, elapsed_s: float) -> SolveStatus:
        """See `Backend.iterate`."""
        work, states, inputs = self._workspace, self._states, self._inputs
        if not (math.isfinite(elapsed_s) and work.is_finite()):
            return SolveStatus.BAD_INPUT
        if elapsed_s > 0.0:
            if elapsed_s != self._shift[0]:
                self._shift = (elapsed_s, Shift.after(self._problem.grid, elapsed_s))
            shift = self._shift[1]
            shift.states(work.states, out=states)
            shift.inputs(work.inputs, out=inputs)
            active = work.active.take(shift.nearest, axis=0)
        elif elapsed_s == 0.0:
            states[:], inputs[:], active = work.states, work.inputs, work.active
        else:
            states[:], inputs[:], active = work.state_reference, work.input_reference, np.zeros_like(work.active)
        states[0] = work.initial
        self._fill_program()
        program = self._program
        solution = self._qp.solve(program, active)
        work.figures[:3] = solution.sweeps, solution.interior_iterations, np.abs(program.defect).max()
        if solution.status is SolveStatus.FAILED:
            return SolveStatus.FAILED
        np.add(states, solution.states, out=work.states)
        np.add(inputs, solution.inputs, out=work.inputs)
        np.maximum(work.inputs, self._lower, out=work.inputs)
        np.minimum(work.inputs, self._upper, out=work.inputs)
        work.active[:] = solution.active
        return solution.status

    def _fill_program(self) -> None:
        """The program about the present plan; its initial difference stays zero."""
        work, program, states, inputs = self._workspace, self._program, self._states, self._inputs
        np.subtract(work.yaw[1:], work.yaw[:-1], out=self._yaw_rate)
        np.divide(self._yaw_rate, self._problem.grid.interval_s, out=self._yaw_rate)
        self._linearise.forward()
        np.subtract(states, work.state_reference, out=program.state_gradient)
        np.multiply(program.state_gradient, program.state_weights, out=program.state_gradient)
        np.subtract(inputs, work.input_reference, out=program.input_gradient)
        np.multiply(program.input_gradient, program.input_weights, out=program.input_gradient)
        np.subtract(self._lower, inputs, out=program.lower)
        np.subtract(self._upper, inputs, out=program.upper)
