"""Mehrotra's predictor-corrector on the bounds of the inputs, on Riccati sweeps in CasADi's virtual machine.

S. Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2 (1992). The sweeps satisfy
the dynamics exactly, so only the bounds have slacks and multipliers; the iterate stays strictly inside.
"""

from __future__ import annotations

import numpy as np

from uasfly.control.buffered import BufferedFunction, fill
from uasfly.control.qp import Active, QpOptions, SolveStatus, StageQp
from uasfly.messages import Array

SHORT_STEP = 0.1  # a corrected step below this is tried again with plain centring
TO_BOUNDARY = 0.995  # share of the way to the boundary


class InteriorPoint:
    """One run on one quadratic program; it can be continued to a smaller gap.

    Attributes:
        point: (N, 3) inputs. iterations: made so far.
        gap: mean complementarity, relative to weight times range squared.
        residual: what is left of the first dual residual, as a share.
    """

    def __init__(self, qp: StageQp, options: QpOptions, predict: BufferedFunction, correct: BufferedFunction) -> None:
        self._qp, self._options = qp, options
        self._predict, self._correct = predict, correct
        span = qp.upper - qp.lower
        size = qp.input_weights * span * span
        self._scale = float(size.mean())
        self.point = np.clip(0.0, qp.lower + 0.1 * span, qp.upper - 0.1 * span)
        # Slacks are kept, not computed from the point: near a bound the difference would lose all its digits.
        self._low, self._high = self.point - qp.lower, qp.upper - self.point
        self._z_lower = options.start_barrier * size / self._low
        self._z_upper = options.start_barrier * size / self._high
        self.gap, self.residual, self.iterations = options.start_barrier, 1.0, 0

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

    def _iterate(self) -> None:
        qp, predict, correct, point = self._qp, self._predict, self._correct, self.point
        low, high, z_lower, z_upper = self._low, self._high, self._z_lower, self._z_upper
        count, gap = 2 * point.size, self.gap * self._scale
        barrier = z_lower / low + z_upper / high
        right = qp.input_gradient - barrier * point
        predict.arguments[4][:], predict.arguments[7][:] = right, qp.input_weights + barrier
        predict.call()
        step = predict.results[0] - point
        dz_lower, dz_upper, affine = self._direction(step, np.zeros_like(step), np.zeros_like(step))
        products = (low + affine * step) * (z_lower + affine * dz_lower)
        products += (high - affine * step) * (z_upper + affine * dz_upper)
        centring = (float(products.sum()) / count / gap) ** 3
        second_lower, second_upper = step * dz_lower, step * dz_upper
        fill(correct.arguments[6:], predict.results[1:])
        # Second-order terms scaled by the affine step, or it stalls; where they still block, plain centring.
        length = 0.0
        for share, target in ((affine * affine, centring * gap), (0.0, max(centring, 0.3) * gap)):
            to_lower, to_upper = (target - share * second_lower) / low, (target + share * second_upper) / high
            correct.arguments[4][:] = right - to_lower + to_upper
            correct.call()
            step = correct.results[0] - point
            dz_lower, dz_upper, length = self._direction(step, to_lower, to_upper)
            if length > SHORT_STEP:
                break
        if length < 1.0:
            length *= TO_BOUNDARY
        self.point = point + length * step
        self._low, self._high = low + length * step, high - length * step
        self._z_lower, self._z_upper = z_lower + length * dz_lower, z_upper + length * dz_upper
        total = float((self._low * self._z_lower + self._high * self._z_upper).sum())
        self.gap = total / count / self._scale
        self.residual *= 1.0 - length

    def _direction(self, step: Array, to_lower: Array, to_upper: Array) -> tuple[Array, Array, float]:
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
