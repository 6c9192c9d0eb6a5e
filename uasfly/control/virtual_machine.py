"""The backend that needs no compiler: stage functions in CasADi's virtual machine, the rest in numpy."""

from __future__ import annotations

import casadi as ca
import numpy as np

from uasfly.control.buffered import BufferedFunction, fill
from uasfly.control.grid import Shift
from uasfly.control.problem import Problem
from uasfly.control.qp import QpOptions, QpSolver, SolveStatus, StageQp
from uasfly.control.qp_riccati import RiccatiQp
from uasfly.control.references import input_reference_function, trim_function
from uasfly.control.riccati import stage_functions
from uasfly.control.transcription import linearisation_function
from uasfly.control.workspace import Workspace
from uasfly.messages import Array
from uasfly.model import INPUTS, PARAMETERS, STATES


class VirtualMachineBackend:
    """Backend on a workspace; any QpSolver can take the place of the tailored one."""

    name = "vm"

    def __init__(
        self, problem: Problem, workspace: Workspace, options: QpOptions | None = None, qp: QpSolver | None = None
    ) -> None:
        self._problem = problem
        self._workspace = workspace
        nodes = problem.grid.nodes
        linearise, pattern = linearisation_function()
        self._qp: QpSolver = qp or RiccatiQp(stage_functions(pattern), pattern.size, nodes, options)
        self._linearise = _linearise_all(linearise, problem)
        self._references = _references_all(problem, workspace)
        self._shift: tuple[float, Shift] = (0.0, Shift.after(problem.grid, 0.0))

    def references(self) -> SolveStatus:
        """See `Backend.references`."""
        work = self._workspace
        data = (work.acceleration, work.velocity, work.yaw, work.force, work.parameters)
        if not (_all_finite(*data) and _all_finite(work.position)):
            return SolveStatus.BAD_INPUT
        fill(self._references.arguments, data)
        self._references.call()
        trims, inputs = self._references.results
        work.state_reference[:, :3], work.state_reference[:, 3:6] = work.position, work.velocity
        work.state_reference[:, 6:], work.input_reference[:] = trims[:, :2], inputs
        return SolveStatus.CONVERGED

    def iterate(self, elapsed_s: float) -> SolveStatus:
        """See `Backend.iterate`."""
        work = self._workspace
        data = (work.initial, work.yaw, work.parameters, work.force, work.state_reference, work.input_reference)
        if not (np.isfinite(elapsed_s) and _all_finite(*data)):
            return SolveStatus.BAD_INPUT
        if elapsed_s > 0.0:
            if elapsed_s != self._shift[0]:
                self._shift = (elapsed_s, Shift.after(self._problem.grid, elapsed_s))
            shift = self._shift[1]
            states, inputs, active = shift.states(work.states), shift.inputs(work.inputs), work.active[shift.nearest]
        elif elapsed_s == 0.0:
            states, inputs, active = work.states.copy(), work.inputs, work.active
        else:
            states, inputs = work.state_reference.copy(), work.input_reference
            active = np.zeros_like(work.active)
        states[0] = work.initial
        qp = self._quadratic_program(states, inputs)
        solution = self._qp.solve(qp, active)
        work.figures[:3] = solution.sweeps, solution.interior_iterations, np.abs(qp.defect).max()
        if solution.status is SolveStatus.FAILED:
            return SolveStatus.FAILED
        np.add(states, solution.states, out=work.states)
        np.clip(inputs + solution.inputs, self._problem.input_lower, self._problem.input_upper, out=work.inputs)
        work.active[:] = solution.active
        return solution.status

    def _quadratic_program(self, states: Array, inputs: Array) -> StageQp:
        work, problem, linearise = self._workspace, self._problem, self._linearise
        fill(linearise.arguments, (states, inputs, work.parameters, work.force, work.yaw))
        linearise.call()
        defect, jacobian = linearise.results
        return StageQp(
            jacobian=jacobian,
            defect=defect,
            initial=work.initial - states[0],
            state_gradient=problem.state_weights * (states - work.state_reference),
            input_gradient=problem.input_weights * (inputs - work.input_reference),
            state_weights=problem.state_weights,
            input_weights=problem.input_weights,
            lower=problem.input_lower - inputs,
            upper=problem.input_upper - inputs,
        )


def _all_finite(*arrays: Array) -> bool:
    return bool(np.isfinite(sum(float(array.sum()) for array in arrays)))


def _row(values: Array) -> ca.DM:
    return ca.DM(values[None, :])


def _linearise_all(linearise: ca.Function, problem: Problem) -> BufferedFunction:
    nodes, symbol = problem.grid.nodes, ca.MX.sym
    states, inputs, parameters = symbol("X", STATES, nodes + 1), symbol("U", INPUTS, nodes), symbol("p", PARAMETERS)
    force, yaw = symbol("F", 3, nodes), symbol("yaw", 1, nodes + 1)
    interval = _row(problem.grid.interval_s)
    yaw_rate = (yaw[:, 1:] - yaw[:, :-1]) / interval
    common = ca.repmat(parameters, 1, nodes)
    defect, jacobian = linearise.map(nodes)(
        states[:, :-1], inputs, common, force, yaw[:, :-1], yaw_rate, interval, states[:, 1:]
    )
    return BufferedFunction(ca.Function("linearise_all", [states, inputs, parameters, force, yaw], [defect, jacobian]))


def _references_all(problem: Problem, workspace: Workspace) -> BufferedFunction:
    nodes, symbol = problem.grid.nodes, ca.MX.sym
    acceleration, velocity = symbol("a", 3, nodes + 1), symbol("v", 3, nodes + 1)
    yaw, force, parameters = symbol("yaw", 1, nodes + 1), symbol("F", 3, nodes), symbol("p", PARAMETERS)
    force_at_nodes = ca.horzcat(force, force[:, -1])
    trims = trim_function().map(nodes + 1)(
        acceleration,
        velocity,
        yaw,
        force_at_nodes,
        ca.repmat(parameters, 1, nodes + 1),
        ca.repmat(ca.DM(workspace.limits), 1, nodes + 1),
    )
    inputs = input_reference_function().map(nodes)(
        trims[:, :-1],
        trims[:, 1:],
        ca.repmat(parameters, 1, nodes),
        _row(problem.grid.interval_s),
        ca.repmat(ca.DM(problem.input_lower), 1, nodes),
        ca.repmat(ca.DM(problem.input_upper), 1, nodes),
    )
    return BufferedFunction(
        ca.Function("references_all", [acceleration, velocity, yaw, force, parameters], [trims, inputs])
    )
