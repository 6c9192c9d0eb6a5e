"""The tailored quadratic program solver in CasADi's virtual machine: Riccati sweeps under an active set.

A warm-started primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002)) guesses which inputs lie
at their bounds, eliminates those in the sweep and corrects the guess until it stands. It needs one sweep most of the
time but may cycle; then an interior point on the same recursion finds the set, and a few active-set sweeps from there
make the result exact.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np

from uasfly.control.buffered import BufferedFunction, fill
from uasfly.control.interior_point import InteriorPoint
from uasfly.control.qp import Active, QpOptions, QpSolution, SolveStatus, StageQp
from uasfly.control.riccati import FACTOR, PACKED, StageFunctions
from uasfly.model import INPUTS, STATES


def _reverse(columns: ca.MX) -> ca.MX:
    return columns[:, ::-1]


class RiccatiQp:
    """QpSolver for N stages; one instance is for one thread."""

    def __init__(self, stages: StageFunctions, packed_size: int, nodes: int, options: QpOptions | None = None) -> None:
        self._options = options or QpOptions()
        self._nodes = nodes
        symbol = ca.MX.sym
        jacobian, defect, initial = symbol("J", packed_size, nodes), symbol("c", STATES, nodes), symbol("dx0", STATES)
        q, r, q_end = symbol("q", STATES, nodes), symbol("r", INPUTS, nodes), symbol("qN", STATES)
        weight_x, weight_u, cost_end = symbol("Q", STATES, nodes), symbol("R", INPUTS, nodes), symbol("PN", PACKED)
        free, fixed, du = symbol("free", INPUTS, nodes), symbol("fixed", INPUTS, nodes), symbol("du", INPUTS, nodes)
        gain, factor = symbol("K", INPUTS * STATES, nodes), symbol("factor", FACTOR, nodes)
        cost_of_defect = symbol("Pc", STATES, nodes)

        def along(function: ca.Function, carried: int, backward: bool) -> Callable[..., list[ca.MX]]:
            """All stages at once; `carried` leading arguments pass from stage to stage, the others are columns."""
            chain = function.mapaccum(f"{function.name()}_all", nodes, carried)

            def call(*arguments: ca.MX) -> list[ca.MX]:
                columns = [_reverse(a) if backward else a for a in arguments[carried:]]
                results = chain.call([*arguments[:carried], *columns])
                return [_reverse(result) for result in results] if backward else list(results)

            return call

        stage_data = (jacobian, defect, q, r, weight_x, weight_u)
        data = [jacobian, defect, initial, q, r, q_end, weight_x, weight_u, cost_end]

        _, _, *sweep = along(stages.backward, 2, True)(cost_end, q_end, *stage_data, free, fixed)
        states, inputs, gradient = along(stages.forward, 1, False)(initial, jacobian, defect, *sweep, free, fixed)
        self._sweep = _buffered("active_set_sweep", [*data, free, fixed], [states, inputs, gradient])

        _, _, big_k, small_k, factors, products = along(stages.barrier_backward, 2, True)(cost_end, q_end, *stage_data)
        forward = along(stages.barrier_forward, 1, False)
        _, inputs = forward(initial, jacobian, defect, big_k, small_k)
        self._predict = _buffered("barrier_predictor", data, [inputs, big_k, factors, products])

        _, small_k = along(stages.barrier_vector, 1, True)(q_end, jacobian, cost_of_defect, q, r, gain, factor)
        _, inputs = forward(initial, jacobian, defect, gain, small_k)
        arguments = [jacobian, defect, initial, q, r, q_end, gain, factor, cost_of_defect]
        self._correct = _buffered("barrier_corrector", arguments, [inputs])

        (states,) = along(stages.rollout, 1, False)(initial, jacobian, defect, du)
        self._rollout = _buffered("rollout", [jacobian, defect, initial, du], [states])
        self._diagonal = np.cumsum(np.arange(1, STATES + 1)) - 1  # places of P's diagonal in its packed triangle

    def solve(self, qp: StageQp, active: Active) -> QpSolution:
        """Solve from a guess of the active bounds."""
        options = self._options
        self._load(self._sweep, qp)
        active, changes, sweeps = self._active_set(qp, active.astype(np.int8), options.active_set_sweeps)
        states, inputs = self._sweep.results[0], self._sweep.results[1]
        status, iterations = SolveStatus.CONVERGED, 0
        if changes:
            self._load(self._predict, qp)
            self._load(self._correct, qp, weights=False)
            interior = InteriorPoint(qp, options, self._predict, self._correct)
            for tolerance in (options.early_gap, options.final_gap):
                status = interior.run(tolerance)
                if status is SolveStatus.FAILED:
                    break
                active, changes, more = self._active_set(qp, interior.active(), options.polish_sweeps)
                sweeps += more
                if not changes:
                    status = SolveStatus.CONVERGED
                    break
            iterations = interior.iterations
            if changes and status is not SolveStatus.FAILED:
                # No set stands (a bound is active with no multiplier, say): the point inside is the result.
                active, inputs = interior.active(), interior.point
                fill(self._rollout.arguments, (qp.jacobian, qp.defect, qp.initial, inputs))
                self._rollout.call()
                states = self._rollout.results[0]
        all_states = np.concatenate((qp.initial[None], states))
        if not np.isfinite(all_states.sum() + inputs.sum()):
            status = SolveStatus.FAILED
        return QpSolution(status, all_states, inputs.copy(), active, sweeps, iterations)

    def _load(self, function: BufferedFunction, qp: StageQp, *, weights: bool = True) -> None:
        places = function.arguments
        data = (qp.jacobian, qp.defect, qp.initial, qp.state_gradient[:-1], qp.input_gradient, qp.state_gradient[-1])
        fill(places, data)
        if weights:
            fill(places[6:], (qp.state_weights[:-1], qp.input_weights))
            places[8][self._diagonal] = qp.state_weights[-1]

    def _active_set(self, qp: StageQp, active: Active, most: int) -> tuple[Active, int, int]:
        """Active set, changes of its last sweep (0: it stands) and sweeps made."""
        free, fixed = self._sweep.arguments[9], self._sweep.arguments[10]
        _, inputs, gradient = self._sweep.results
        tolerance = self._options.bound_tolerance
        last, changes = 0, 1
        for sweep in range(1, most + 1):
            free[:] = active == 0
            fixed[:] = np.where(active < 0, qp.lower, np.where(active > 0, qp.upper, 0.0))
            self._sweep.call()
            below, above = inputs < qp.lower - tolerance, inputs > qp.upper + tolerance
            entering = above.astype(np.int8) - below.astype(np.int8)
            following = np.where(active == 0, entering, np.where(active * gradient > tolerance, 0, active)).astype(
                np.int8
            )
            changes = int(np.count_nonzero(following != active))
            active = following
            if not changes or (sweep >= 3 and changes >= last):
                return active, changes, sweep
            last = changes
        return active, changes, most


def _buffered(name: str, arguments: list[ca.MX], results: list[ca.MX]) -> BufferedFunction:
    return BufferedFunction(ca.Function(name, arguments, results))
