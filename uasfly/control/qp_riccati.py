"""The tailored quadratic program solver in CasADi's virtual machine: Riccati sweeps under an active set.

A warm-started primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002)) guesses which inputs lie
at their bounds, eliminates those in the sweep and corrects the guess until it stands. It needs one sweep most of the
time but may cycle; then an interior point on the same recursion finds the set, and a few active-set sweeps from there
make the result exact.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.control.interior_point import InteriorPoint
from uasfly.control.qp import Active, QpOptions, QpSolution, SolveStatus, StageQp
from uasfly.control.riccati_machine import MachineFunctions
from uasfly.control.sweeps import RiccatiSweeps

MANY = 0.25  # changes a stage; where more than so many do not become fewer, the guess is no good


class RiccatiQp:
    """QpSolver for N stages; one instance is for one thread.

    Attributes:
        program: arrays that may be filled and handed to `solve` instead of others, which are copied.
    """

    def __init__(
        self, functions: MachineFunctions, packed_size: int, nodes: int, options: QpOptions | None = None
    ) -> None:
        self._options = options or QpOptions()
        self._sweeps = RiccatiSweeps(functions, packed_size, nodes)
        self.program = self._sweeps.program

    def solve(self, qp: StageQp, active: Active) -> QpSolution:
        """Solve from a guess of the active bounds."""
        options, work = self._options, self._sweeps
        work.load(qp)
        if not options.active_set_sweeps:
            work.inputs[:] = work.gradient[:] = 0.0
        active, changes, sweeps = self._active_set(qp, active, options.active_set_sweeps)
        status, iterations = SolveStatus.CONVERGED, 0
        if changes:
            interior = InteriorPoint(qp, options, work)
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
                active, work.inputs[:] = interior.active(), interior.point
                work.rollout()
        # What is not finite stays so down to the last state.
        if not math.isfinite(sum(work.states[-1].tolist())):
            status = SolveStatus.FAILED
        return QpSolution(status, work.states.copy(), work.inputs.copy(), active, sweeps, iterations)

    def _active_set(self, qp: StageQp, active: Active, most: int) -> tuple[Active, int, int]:
        """Active set, changes of its last sweep (0: it stands) and sweeps made."""
        work, tolerance = self._sweeps, self._options.bound_tolerance
        inputs, gradient = work.inputs, work.gradient
        least, greatest = qp.lower - tolerance, qp.upper + tolerance
        last, before, changes = -1, active.size + 1, 1
        for sweep in range(1, most + 1):
            any_held = np.count_nonzero(active) > 0
            if any_held:
                at_bound = active != 0
                work.free[:] = ~at_bound
                work.fixed[:] = np.where(active < 0, qp.lower, qp.upper) * at_bound
                work.active_set(np.logical_or.reduce(at_bound, axis=1).tolist(), last)
            else:
                work.unconstrained(last)
            above, below = inputs > greatest, inputs < least  # neither for what is held
            if not (any_held or np.count_nonzero(above | below)):
                return active, 0, sweep
            following = above.view(np.int8) - below.view(np.int8)
            if any_held:
                following += np.where(active * gradient > tolerance, 0, active)
            changed = following != active
            active, changes = following, int(np.count_nonzero(changed))
            if not changes or (changes >= before and changes > MANY * qp.nodes):
                return active, changes, sweep
            before = changes
            # Behind this stage the cost to go is what it was.
            last = int(np.flatnonzero(changed)[-1]) // active.shape[1]
        return active, changes, most
