"""Mehrotra's predictor-corrector on the bounds of the inputs, on Riccati sweeps in CasADi's virtual machine.

S. Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2 (1992). The sweeps satisfy
the dynamics exactly, so only the bounds have slacks and multipliers; the iterate stays strictly inside.
"""

from __future__ import annotations

import numpy as np

from uasfly.control.qp import Active, QpOptions, SolveStatus, StageQp
from uasfly.control.sweeps import RiccatiSweeps
from uasfly.messages import Array

SHORT_STEP = 0.1  # a corrected step below this is tried again with plain centring
TO_BOUNDARY = 0.995  # share of the way to the boundary
START_MARGIN = 0.1  # share of the range that the first point keeps from its bounds


class InteriorPoint:
    """One run on one quadratic program; it can be continued to a smaller gap.

    Attributes:
        point: (N, 3) inputs. iterations: made so far.
        gap: mean complementarity, relative to weight times range squared.
        residual: what is left of the first dual residual, as a share.
    """

    def __init__(self, qp: StageQp, options: QpOptions, sweeps: RiccatiSweeps) -> None:
        """Start from what the active set came to last: its inputs moved inside, its gradients as multipliers."""
        self._qp, self._options, self._sweeps = qp, options, sweeps
        span = qp.upper - qp.lower
        size = qp.input_weights * span * span
        self._scale = float(size.mean())
        self.point = np.clip(sweeps.inputs, qp.lower + START_MARGIN * span, qp.upper - START_MARGIN * span)
        # Slacks are kept, not computed from the point: near a bound the difference would lose all its digits.
        self._low, self._high = self.point - qp.lower, qp.upper - self.point
        self._z_lower = options.start_barrier * size / self._low + np.maximum(sweeps.gradient, 0.0)
        self._z_upper = options.start_barrier * size / self._high + np.maximum(-sweeps.gradient, 0.0)
        self.gap, self.residual, self.iterations = self._complementarity(), 1.0, 0

    def run(self, tolerance: float) -> SolveStatus:
        """Iterate until gap and residual are below `tolerance`; INEXACT when they only came below the loose gap."""
        while self.gap >= tolerance or self.residual >= tolerance:
            if self.iterations >= self._options.interior_iterations or not np.isfinite(self.gap):
                loose = self._options.loose_gap
                return SolveStatus.INEXACT if self.gap < loose and self.residual < loose else SolveStatus.FAILED
            self.iterations += 1
            self._iterate()
        return SolveStatus.CONVERGED

    def active(self) -> Active:
        """Guess of the active bounds (N, 3): where the multiplier outweighs the slack."""
        weights = self._qp.input_weights
        at_lower, at_upper = self._z_lower > self._low * weights, self._z_upper > self._high * weights
        return np.asarray(at_upper.astype(np.int8) - at_lower.astype(np.int8))

    def _complementarity(self) -> float:
        total = float(np.vdot(self._low, self._z_lower) + np.vdot(self._high, self._z_upper))
        return total / (2 * self.point.size) / self._scale

    def _iterate(self) -> None:
        qp, sweeps, point = self._qp, self._sweeps, self.point
        low, high, z_lower, z_upper = self._low, self._high, self._z_lower, self._z_upper
        count, gap = 2 * point.size, self.gap * self._scale
        barrier = z_lower / low + z_upper / high
        right = qp.input_gradient - barrier * point
        sweeps.barrier_gradient[:], sweeps.barrier_weights[:] = right, qp.input_weights + barrier
        sweeps.predict()
        step = sweeps.inputs - point
        dz_lower, dz_upper, affine = self._direction(step, 0.0, 0.0)
        products = float(np.vdot(low + affine * step, z_lower + affine * dz_lower))
        products += float(np.vdot(high - affine * step, z_upper + affine * dz_upper))
        centring = (products / count / gap) ** 3
        second_lower, second_upper = step * dz_lower, step * dz_upper
        # Second-order terms scaled by the affine step, or it stalls; where they still block, plain centring.
        length = 0.0
        for share, target in ((affine * affine, centring * gap), (0.0, max(centring, 0.3) * gap)):
            to_lower, to_upper = (target - share * second_lower) / low, (target + share * second_upper) / high
            sweeps.barrier_gradient[:] = right - to_lower + to_upper
            sweeps.correct()
            step = sweeps.inputs - point
            dz_lower, dz_upper, length = self._direction(step, to_lower, to_upper)
            if length > SHORT_STEP:
                break
        if length < 1.0:
            length *= TO_BOUNDARY
        self.point = point + length * step
        self._low, self._high = low + length * step, high - length * step
        self._z_lower, self._z_upper = z_lower + length * dz_lower, z_upper + length * dz_upper
        self.gap = self._complementarity()
        self.residual *= 1.0 - length

    def _direction(self, step: Array, to_lower: Array | float, to_upper: Array | float) -> tuple[Array, Array, float]:
        """Changes of the multipliers, and the longest step, at most 1, that turns nothing negative."""
        low, high, z_lower, z_upper = self._low, self._high, self._z_lower, self._z_upper
        dz_lower = to_lower - z_lower - z_lower / low * step
        dz_upper = to_upper - z_upper + z_upper / high * step
        shrink = min(
            float((step / low).min()),
            float((-step / high).min()),
            float((dz_lower / z_lower).min()),
            float((dz_upper / z_upper).min()),
        )
        return dz_lower, dz_upper, -1.0 / shrink if shrink < -1.0 else 1.0
