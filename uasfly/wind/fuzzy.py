"""Takagi-Sugeno form of the six-axis model: eight rules, one a corner of the box of body rates.

(Asignacion et al. 2022, table I.) Inside the box the rules' weighted sum is the nonlinear model, not an approximation
of it, because the model is affine in the rates.
"""

from __future__ import annotations

import itertools

import numpy as np

from uasfly.messages import Array
from uasfly.wind.six_axes import SixAxisBody

RATE_BOUND_RAD_S = 10.0
CORNERS: Array = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * RATE_BOUND_RAD_S  # (8, 3): p, q, r [rad/s]


def rule_matrices(body: SixAxisBody) -> Array:
    """A_i of the eight rules, shape (8, 6, 6), in the order of `CORNERS`."""
    return np.stack([body.system_matrix(corner) for corner in CORNERS])


def memberships(rates_rad_s: Array) -> Array:
    """How far each rule holds at these rates, shape (8,): not negative, with sum 1.

    Beyond +-10 rad/s a rate counts as 10 rad/s.
    """
    weights = []
    for rate in rates_rad_s.tolist():
        high = min(max(0.5 + 0.5 * rate / RATE_BOUND_RAD_S, 0.0), 1.0)
        weights.append((1.0 - high, high))
    return np.array([a * b * c for a, b, c in itertools.product(*weights)])


def blend(rates_rad_s: Array, matrices: Array) -> Array:
    """Sum of the rules' matrices (8, n, m), weighted at these rates: shape (n, m)."""
    blended: Array = (memberships(rates_rad_s) @ matrices.reshape(len(CORNERS), -1)).reshape(matrices.shape[1:])
    return blended
