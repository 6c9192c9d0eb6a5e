"""The optimal control problem of uasfly put into acados: same model, grid, weights and bounds, stock options.

Imported only by the process that runs acados.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from uasfly.bench.acados_messages import MOST_NODES, Statement, Steps, Times
from uasfly.control.grid import Grid, Shift
from uasfly.control.iteration import COLD_ITERATIONS
from uasfly.control.transcription import interval_end, with_force
from uasfly.messages import Array
from uasfly.model import INPUTS, PARAMETERS, STATES

VALUES = PARAMETERS + 6  # model parameters, force (3), yaw at the interval's start, yaw rate, length of the interval
NAME = "uasfly_multirotor"


def make_solver(folder: Path) -> Any:
    """Generate and compile acados' solver in a folder, for any grid of up to 160 intervals; takes some seconds.

    The dynamics are those of uasfly's transcription, as a discrete step: an integrator of acados itself would solve
    another problem (a Runge-Kutta step of the attitude is unstable on the last intervals) in more time. Everything
    that is not set here is as acados ships it: SQP_RTI, Gauss-Newton, PARTIAL_CONDENSING_HPIPM.
    """
    from acados import acados_template as template  # type: ignore[import-not-found]

    ocp = template.AcadosOcp()
    ocp.model.name = NAME
    state, inputs, values = ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("p", VALUES)
    parameters = with_force(values[:PARAMETERS], values[PARAMETERS : PARAMETERS + 3])
    ocp.model.x, ocp.model.u, ocp.model.p = state, inputs, values
    yaw, yaw_rate, interval = values[VALUES - 3], values[VALUES - 2], values[VALUES - 1]
    ocp.model.disc_dyn_expr = interval_end(state, inputs, parameters, yaw, yaw_rate, interval)
    ocp.parameter_values = np.ones(VALUES)
    ocp.dims.N = MOST_NODES
    ocp.cost.cost_type = ocp.cost.cost_type_e = "LINEAR_LS"
    ocp.cost.W, ocp.cost.W_e = np.eye(STATES + INPUTS), np.eye(STATES)
    ocp.cost.Vx = np.vstack((np.eye(STATES), np.zeros((INPUTS, STATES))))
    ocp.cost.Vu = np.vstack((np.zeros((STATES, INPUTS)), np.eye(INPUTS)))
    ocp.cost.Vx_e = np.eye(STATES)
    ocp.cost.yref, ocp.cost.yref_e = np.zeros(STATES + INPUTS), np.zeros(STATES)
    ocp.constraints.lbu, ocp.constraints.ubu = -np.ones(INPUTS), np.ones(INPUTS)
    ocp.constraints.idxbu, ocp.constraints.x0 = np.arange(INPUTS), np.zeros(STATES)
    ocp.solver_options.integrator_type = "DISCRETE"
    ocp.solver_options.tf = 3.0
    install = Path(template.__file__).parents[1] / "install"
    ocp.acados_include_path, ocp.acados_lib_path = str(install / "include"), str(install / "lib")
    ocp.code_export_directory = str(folder / "generated")
    os.environ.update(ACADOS_SOURCE_DIR=str(install), ACADOS_PYTHON_INTERFACE_PATH=str(Path(template.__file__).parent))
    with contextlib.chdir(folder):
        return template.AcadosOcpSolver(ocp, json_file=str(folder / "ocp.json"), verbose=True)


class AcadosRunner:
    """Runs steps through acados' solver, each from its own last plan, moved along by the clock as uasfly's is."""

    def __init__(self, solver: Any) -> None:
        self._solver = solver
        self._grid = Grid.from_intervals(np.ones(1))
        self._states: Array = np.zeros((2, STATES))
        self._inputs: Array = np.zeros((1, INPUTS))
        self._start_s = 0.0

    def state(self, statement: Statement) -> None:
        """Take up another problem."""
        solver, intervals = self._solver, statement.interval_s
        self._grid = Grid.from_intervals(intervals)
        solver.set_new_time_steps(intervals)
        for k in range(intervals.size):
            # acados weighs a stage's cost with the length of its interval; the weights handed in hold theirs already
            stage = np.concatenate((statement.state_weights[k], statement.input_weights[k])) / intervals[k]
            solver.cost_set(k, "W", np.diag(stage))
            solver.constraints_set(k, "lbu", statement.input_lower)
            solver.constraints_set(k, "ubu", statement.input_upper)
        solver.cost_set(intervals.size, "W", np.diag(statement.state_weights[-1]))

    def run(self, steps: Steps, clock: Any) -> Times:
        """Solve step by step; only `solve()` is between the readings of the clock [s]."""
        count = steps.start_s.size
        times, inputs, status = np.zeros(count), np.zeros((count, INPUTS)), np.zeros(count, np.int64)
        for step in range(count):
            self._guess(steps, step)
            self._fill(steps, step)
            for _ in range(COLD_ITERATIONS if steps.fresh[step] else 1):
                started = clock()
                status[step] = self._solver.solve()
                times[step] += clock() - started
            self._keep(float(steps.start_s[step]))
            inputs[step] = self._inputs[0]
        return Times(1e3 * times, inputs, status)

    def _guess(self, steps: Steps, step: int) -> None:
        if steps.fresh[step]:
            states, inputs = steps.state_reference[step].copy(), steps.input_reference[step]
        else:
            shift = Shift.after(self._grid, float(steps.start_s[step]) - self._start_s)
            states, inputs = shift.states(self._states), shift.inputs(self._inputs)
        states[0] = steps.initial[step]
        for k, state in enumerate(states):
            self._solver.set(k, "x", state)
        for k, value in enumerate(inputs):
            self._solver.set(k, "u", value)

    def _fill(self, steps: Steps, step: int) -> None:
        solver, nodes = self._solver, self._grid.nodes
        yaw, length = steps.yaw[step], self._grid.interval_s
        rate = np.diff(yaw) / length
        for k in range(nodes):
            solver.set(k, "yref", np.concatenate((steps.state_reference[step, k], steps.input_reference[step, k])))
            own = (yaw[k], rate[k], length[k])
            solver.set(k, "p", np.concatenate((steps.parameters[step], steps.force[step], own)))
        solver.set(nodes, "yref", steps.state_reference[step, nodes])
        solver.set(0, "lbx", steps.initial[step])
        solver.set(0, "ubx", steps.initial[step])

    def _keep(self, start_s: float) -> None:
        nodes = self._grid.nodes
        self._states = np.array([self._solver.get(k, "x") for k in range(nodes + 1)])
        self._inputs = np.array([self._solver.get(k, "u") for k in range(nodes)])
        self._start_s = start_s
