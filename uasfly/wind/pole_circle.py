"""Where the poles of the disturbance observer lie, and the gains that put them there (Asignacion et al. 2022, eq. 11).

All poles of all rules have to be in the circle with centre -2 pi c and radius 2 pi r, with one Lyapunov matrix X for
all rules (D-stability):

    [ -2 pi r X                X (A_i - L_i C + 2 pi c I) ]
    [ (its transpose)          -2 pi r X                  ]  < 0,   X > 0.

Every state is measured, C = I, so L_i = A_i + 2 pi c I puts every pole into the very centre: the off-diagonal blocks
vanish, and any X > 0 will do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.errors import UasflyError
from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class PoleCircle:
    """The circle.

    Attributes:
        cutoff_hz: c, the frequency up to which the observer follows a disturbance.
        radius_hz: r, how far the poles may be from the centre; smaller than c, or the observer might be unstable.
    """

    cutoff_hz: float
    radius_hz: float

    def __post_init__(self) -> None:
        if not 0.0 < self.radius_hz < self.cutoff_hz < math.inf:
            raise UasflyError(
                f"poles: expected 0 < radius_hz < cutoff_hz, found radius {self.radius_hz}, cut-off {self.cutoff_hz}"
            )

    @property
    def cutoff_rad_s(self) -> float:
        """2 pi c: the poles' distance from the origin [rad/s]."""
        return 2.0 * math.pi * self.cutoff_hz

    def central_gains(self, rules: Array) -> Array:
        """L_i that put all poles of each rule's A_i into the centre; both of shape (rules, n, n)."""
        return rules + self.cutoff_rad_s * np.eye(rules.shape[1])

    def matrix_inequality(self, lyapunov: Array, closed_loop: Array) -> Array:
        """Left side of (11) for one rule, shape (2n, 2n); negative definite where the inequality holds.

        Args:
            lyapunov: X, shape (n, n).
            closed_loop: A_i - L_i C, shape (n, n).
        """
        bound = -2.0 * math.pi * self.radius_hz * lyapunov
        offset = lyapunov @ (closed_loop + self.cutoff_rad_s * np.eye(len(closed_loop)))
        return np.block([[bound, offset], [offset.T, bound]])


DP1 = PoleCircle(cutoff_hz=1.0, radius_hz=0.5)  # the paper's two designs
DP2 = PoleCircle(cutoff_hz=10.0, radius_hz=5.0)
