"""The same quadratic program solved by a library, piqp: what the tailored solver is compared with."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from uasfly.control.qp import Active, QpSolution, SolveStatus, StageQp
from uasfly.control.transcription import JacobianPattern


class LibraryQp:
    """QpSolver on piqp's sparse interior point (an optional package); slow, general and kept by others.

    Raises:
        ModuleNotFoundError: where piqp is not installed.
    """

    def __init__(self, pattern: JacobianPattern, tolerance: float = 1e-14) -> None:
        import piqp  # type: ignore[import-untyped]

        self._piqp = piqp
        self._pattern = pattern
        self._tolerance = tolerance

    def solve(self, qp: StageQp, active: Active) -> QpSolution:  # noqa: ARG002 - an interior point takes no guess
        """Solve with variables ordered dx_0, du_0, dx_1, ..., dx_N."""
        nodes, states = qp.state_gradient.shape
        states_n, inputs_n = states, qp.input_gradient.shape[1]
        a, b = self._pattern.dense(qp.jacobian)
        width = states_n + inputs_n
        count = (nodes - 1) * width + states_n
        diagonal, linear = np.empty(count), np.empty(count)
        lower, upper = np.full(count, -np.inf), np.full(count, np.inf)
        x_places = np.arange(nodes)[:, None] * width + np.arange(states_n)
        u_places = np.arange(nodes - 1)[:, None] * width + states_n + np.arange(inputs_n)
        diagonal[x_places], linear[x_places] = qp.state_weights, qp.state_gradient
        diagonal[u_places], linear[u_places] = qp.input_weights, qp.input_gradient
        lower[u_places], upper[u_places] = qp.lower, qp.upper
        blocks = sparse.lil_matrix((nodes * states_n, count))
        right = np.concatenate((qp.initial, -qp.defect.ravel()))
        blocks[:states_n, :states_n] = np.eye(states_n)
        for k in range(nodes - 1):
            row, column = (k + 1) * states_n, k * width
            blocks[row : row + states_n, column : column + states_n] = a[k]
            blocks[row : row + states_n, column + states_n : column + width] = b[k]
            blocks[row : row + states_n, column + width : column + width + states_n] = -np.eye(states_n)
        solver = self._piqp.SparseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = self._tolerance
        solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = self._tolerance
        solver.settings.max_iter = 500
        solver.setup(sparse.diags(diagonal).tocsc(), linear, blocks.tocsc(), right, x_l=lower, x_u=upper)
        status = solver.solve()
        result = solver.result
        solved = status == self._piqp.PIQP_SOLVED
        solution = np.asarray(result.x)
        at_lower = np.asarray(result.z_bl)[u_places] > 1e-7
        at_upper = np.asarray(result.z_bu)[u_places] > 1e-7
        return QpSolution(
            SolveStatus.CONVERGED if solved else SolveStatus.FAILED,
            solution[x_places],
            solution[u_places],
            (at_upper.astype(np.int8) - at_lower.astype(np.int8)),
            0,
            int(result.info.iter),
        )
