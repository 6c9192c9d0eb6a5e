"""The way back to a place that the filter has found again, without a step.

A marker that is seen after a while tells where the vehicle is, and GNSS has meanwhile led it somewhere else: the filter
corrects itself at once. Who flies by the estimate would see a step; so what is told starts where it was and glides.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array

SMALLEST_M = 0.02  # a smaller correction is as those of every sighting
SPEED_M_S = 0.25


class Glide:
    """Offset on the position that is told, shrinking to nothing at SPEED_M_S."""

    def __init__(self) -> None:
        self._start = np.zeros(3)
        self._start_s = -math.inf
        self._lasts_s = 0.0

    def stepped(self, time_s: float, step: Array) -> None:
        """The filter's position has changed by `step` (3,) [m] at a time."""
        if not math.dist(step, (0.0, 0.0, 0.0)) > SMALLEST_M:
            return
        self._start = self.offset(time_s) - step
        self._start_s = time_s
        self._lasts_s = math.dist(self._start, (0.0, 0.0, 0.0)) / SPEED_M_S

    def active(self, time_s: float) -> bool:
        """Whether there is an offset."""
        return time_s - self._start_s < self._lasts_s

    def offset(self, time_s: float) -> Array:
        """To be added to the filter's position (3,) [m]."""
        if not self.active(time_s):
            return np.zeros(3)
        share = max(0.0, time_s - self._start_s) / self._lasts_s
        return (1.0 - share) * self._start
