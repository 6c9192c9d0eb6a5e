"""Quadratic programs as the controller meets them, and a dense, exact solution by scipy."""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from tests.control.vehicle import f550
from uasfly.airframe import Weights
from uasfly.control.grid import Grid, geometric_intervals
from uasfly.control.problem import Problem, problem_from_weights
from uasfly.control.qp import StageQp
from uasfly.control.transcription import linearisation_function
from uasfly.messages import Array
from uasfly.model import INPUTS, STATES, controller_parameters

LINEARISE, PATTERN = linearisation_function()
PAPER = Weights(position=(25, 25, 17), velocity=(11, 11, 11), tilt=(1, 1), roll=135, pitch=135, thrust=750, terminal=10)


def small_problem(nodes: int = 15, *, tight: bool = False, move: float = 0.0) -> Problem:
    """The f550's problem on a short grid, with wide bounds or with the paper's, and a weight on the first step."""
    tilt = 0.1 if tight else np.radians(30.0)
    thrust = (0.31, 0.38) if tight else (0.15, 0.75)
    grid = Grid.from_intervals(geometric_intervals(3.0, nodes, 0.02))
    weights = PAPER.model_copy(update={"move": move})
    return problem_from_weights(grid, weights, np.array((thrust[0], -tilt, -tilt)), np.array((thrust[1], tilt, tilt)))


def random_program(rng: np.random.Generator, problem: Problem, error_m: float = 3.0) -> StageQp:
    """The program of an iteration far from a reference at the origin, about a random plan inside the bounds."""
    nodes = problem.grid.nodes
    parameters = controller_parameters(f550().model, rng.normal(size=3), 28.54209)
    inputs = rng.uniform(problem.input_lower, problem.input_upper, (nodes, INPUTS))
    states = np.concatenate(
        (
            error_m * rng.normal(size=(nodes + 1, 3)),
            rng.normal(size=(nodes + 1, 3)),
            rng.uniform(-0.3, 0.3, (nodes + 1, 2)),
        ),
        axis=1,
    )
    yaw, rate = rng.uniform(-3.0, 3.0), rng.uniform(-0.5, 0.5)
    defects, jacobians = np.empty((nodes, STATES)), np.empty((nodes, PATTERN.size))
    for k in range(nodes):
        results = LINEARISE(
            states[k],
            inputs[k],
            parameters,
            parameters[7:10],
            yaw + rate * problem.grid.time_s[k],
            rate,
            problem.grid.interval_s[k],
            states[k + 1],
        )
        defects[k], jacobians[k] = (np.asarray(result).ravel() for result in results)
    return StageQp(
        jacobian=jacobians,
        defect=defects,
        initial=0.3 * rng.normal(size=STATES),
        state_gradient=problem.state_weights * states,
        input_gradient=problem.input_weights * (inputs - np.array((0.3436, 0.0, 0.0))),
        state_weights=problem.state_weights,
        input_weights=problem.input_weights,
        lower=problem.input_lower - inputs,
        upper=problem.input_upper - inputs,
    )


def condensed(qp: StageQp) -> tuple[Array, Array, Array, Array]:
    """States as an affine map of all inputs, dx = map du + offset, and the cost's Hessian and gradient by du."""
    a, b = PATTERN.dense(qp.jacobian)
    nodes, count = qp.nodes, qp.nodes * INPUTS
    maps, offsets = np.zeros((nodes + 1, STATES, count)), np.zeros((nodes + 1, STATES))
    offsets[0] = qp.initial
    for k in range(nodes):
        maps[k + 1] = a[k] @ maps[k]
        maps[k + 1][:, k * INPUTS : (k + 1) * INPUTS] += b[k]
        offsets[k + 1] = a[k] @ offsets[k] + qp.defect[k]
    hessian = np.einsum("kxi,kx,kxj->ij", maps, qp.state_weights, maps) + np.diag(qp.input_weights.ravel())
    gradient = np.einsum("kxi,kx->i", maps, qp.state_weights * offsets + qp.state_gradient)
    return maps, offsets, hessian, gradient + qp.input_gradient.ravel()


def dense_solution(qp: StageQp) -> tuple[Array, Array]:
    """States (N + 1, 8) and inputs (N, 3) of the minimum, by bounded least squares with an exact active set."""
    maps, offsets, hessian, gradient = condensed(qp)
    factor = np.linalg.cholesky(hessian).T
    right = -np.linalg.solve(factor.T, gradient)
    result = lsq_linear(factor, right, (qp.lower.ravel(), qp.upper.ravel()), method="bvls", tol=1e-14, max_iter=2000)
    inputs = result.x
    return maps @ inputs + offsets, inputs.reshape(-1, INPUTS)


def optimality(qp: StageQp, inputs: Array) -> float:
    """How far inputs (N, 3) are from the minimum: largest projected gradient, relative to the input weights."""
    _, _, hessian, gradient = condensed(qp)
    slope = (hessian @ inputs.ravel() + gradient).reshape(inputs.shape) / qp.input_weights
    return float(np.abs(np.clip(inputs - slope, qp.lower, qp.upper) - inputs).max())
