"""Exact steps of x' = M x + w(t) between two samples, for a w that is quadratic in time.

States that change linearly over a step make the drive A(p, q, r) x of the six-axis model quadratic, so nothing is lost
at a low sampling rate but what the samples themselves do not tell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from uasfly.errors import UasflyError
from uasfly.messages import Array

LONGEST_STEP_S = 0.5  # over a longer gap nobody knows what the drive has been


@dataclass(frozen=True, slots=True)
class ExactStep:
    """x(end) = transition x(start) + the drive's values at start, middle and end of the step, each times its matrix.

    Attributes:
        transition, start, middle, end: shape (n, n).
    """

    transition: Array
    start: Array
    middle: Array
    end: Array

    def advance(self, state: Array, start: Array, middle: Array, end: Array) -> Array:
        """State at the end of the step; state and drives of shape (n, k), k systems beside one another."""
        advanced: Array = self.transition @ state + self.start @ start + self.middle @ middle + self.end @ end
        return advanced


def exact_step(system: Array, step_s: float) -> ExactStep:
    """The step of this length for M of shape (n, n), from one matrix exponential (Van Loan's way).

    With the step as the unit of time the drive is a state as well: w' = w1, w1' = w2, w2' = 0. What it adds is the sum
    of w, w1 and w2, each times its block beside the transition; they follow from the values at start, middle and end.
    """
    n = len(system)
    chain = np.zeros((4 * n, 4 * n))
    chain[:n, :n] = system * step_s
    for block in range(3):
        chain[block * n : (block + 1) * n, (block + 1) * n : (block + 2) * n] = np.eye(n)
    transition, first, second, third = np.split(expm(chain)[:n], 4, axis=1)
    return ExactStep(
        transition,
        start=step_s * (first - 3.0 * second + 4.0 * third),
        middle=step_s * (4.0 * second - 8.0 * third),
        end=step_s * (4.0 * third - second),
    )


class Steps:
    """Times of the samples, and the exact steps between them; a step as long as the last one costs nothing.

    Args:
        system: M, shape (n, n).
    """

    def __init__(self, system: Array) -> None:
        self._system = system
        self._time_s = -math.inf
        self._step_s = 0.0
        self._step: ExactStep | None = None

    def is_new(self, time_s: float) -> bool:
        """Whether a sample of this time is newer than the last; one that has no time is not."""
        return time_s > self._time_s and math.isfinite(time_s)

    def to(self, time_s: float) -> ExactStep | None:
        """The step to a new sample; None for the first one and after a gap, where the observer has to start anew."""
        step_s = time_s - self._time_s
        self._time_s = time_s
        if step_s > LONGEST_STEP_S:
            return None
        if self._step is None or abs(step_s - self._step_s) > 1e-9:
            self._step_s, self._step = step_s, exact_step(self._system, step_s)
        return self._step


def checked_rate(name: str, value: float) -> float:
    """A gain or time that has to be positive, or an error that names it."""
    if not (math.isfinite(value) and value > 0.0):
        raise UasflyError(f"{name}: expected a positive number, found {value}")
    return value
