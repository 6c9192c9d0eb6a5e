"""Do the measured position and the measured velocity tell the same motion? Without any model of the vehicle.

Where both contradict the model and agree with each other, the vehicle is being pushed harder than the model can
explain. Where they part, one of them is wrong, and which one the model tells: a position that jumps is an error of
GNSS, a velocity that the position does not follow is no motion.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import repeat

from uasfly.observer.door import Odometry

WINDOW_S = 2.0  # longer than the bias takes for a jump of many metres
SPACING_S = 0.04  # of what is remembered: the window is looked through with every sample
APART_M = 0.12  # the velocity's own wander over the window, and the steps of PX4's corrections
NOISE_SIGMAS = 3.0  # of the position, on top
LONGEST_ELAPSED_S = 0.2

Vector = tuple[float, float, float]


class Agreement:
    """Looks at the measured position minus the way that the measured velocity has gone.

    Attributes:
        apart_m: how far that has moved within the window.
        agrees: whether that is no more than noise; True while nothing can be said.
    """

    def __init__(self) -> None:
        self.apart_m = 0.0
        self.agrees = True
        self._past_s: deque[float] = deque()
        self._past: deque[Vector] = deque()
        self._time_s = -math.inf
        self._way: Vector = (0.0, 0.0, 0.0)

    def look(self, odometry: Odometry, position_sigma_m: float) -> None:
        """Take in a sample before the filter does.

        Args:
            odometry: what can be used of it; a part that cannot says nothing.
            position_sigma_m: of the position's noise, as it is known.
        """
        _, has_position, has_velocity = odometry.use
        elapsed = odometry.time_s - self._time_s
        self._time_s = odometry.time_s
        past, past_s = self._past, self._past_s
        if not (0.0 <= elapsed < LONGEST_ELAPSED_S and has_velocity):
            past.clear()
            past_s.clear()
            elapsed = 0.0
        vx, vy, vz = odometry.velocity
        wx, wy, wz = self._way
        self._way = wx, wy, wz = wx + vx * elapsed, wy + vy * elapsed, wz + vz * elapsed
        while past_s and past_s[0] < odometry.time_s - WINDOW_S:
            past_s.popleft()
            past.popleft()
        if has_position and has_velocity:
            x, y, z = odometry.position
            now = (x - wx, y - wy, z - wz)
            if not past_s or odometry.time_s >= past_s[-1] + SPACING_S:
                past_s.append(odometry.time_s)
                past.append(now)
            self.apart_m = max(map(math.dist, past, repeat(now)))
        elif not past:
            self.apart_m = 0.0
        self.agrees = self.apart_m <= APART_M + NOISE_SIGMAS * position_sigma_m
