"""The wind's horizontal force as the accelerometer feels it, over the last second and a half.

In the plane of the rotors it reads the air's force alone. With the same elimination as in `thrust_free`,

    h = (R [f_x, f_y, 0])_h - s (R [f_x, f_y, 0])_z,

there is no thrust in it, and an error of the attitude turns only this force, not gravity.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import AccelerometerSample, Array
from uasfly.wind.direct_kernel import FELT_SAMPLES, FELT_STEP_S
from uasfly.wind.force_kernel import WINDOW_S

LONGEST_GAP_S = 0.05  # between samples, and from the newest to now: with a longer one nothing is told
LARGEST_M_S2 = 40.0  # along each axis of the rotors' plane: no air pushes like that
_AGES = FELT_STEP_S * np.arange(FELT_SAMPLES)[::-1]


class FeltForce:
    """What is kept of the accelerometer's samples; `add` keeps them, `take` works them off."""

    def __init__(self) -> None:
        self._fresh: list[AccelerometerSample] = []
        self._times: Array = np.empty(0)
        self._forces: Array = np.empty((0, 2))

    def add(self, sample: AccelerometerSample) -> None:
        """Take in a sample."""
        self._fresh.append(sample)

    def forget(self) -> None:
        """Begin anew."""
        self._fresh.clear()
        self._times, self._forces = np.empty(0), np.empty((0, 2))

    def take(self, times_s: Array, quaternions: Array) -> None:
        """Work off the samples since the last time; those without an attitude near them wait.

        Args:
            times_s: (n,) of the attitudes since the last time, rising.
            quaternions: (n, 4) unit, body to world.
        """
        newest_s = float(self._times[-1]) if len(self._times) else -math.inf
        ready, later = [], []
        for sample in self._fresh:
            x, y, _ = sample.specific_force_in_body.tolist()
            if times_s[-1] < sample.time_s < times_s[-1] + LONGEST_GAP_S:
                later.append(sample)
            elif (
                newest_s < sample.time_s <= times_s[-1] and abs(x) < LARGEST_M_S2 and abs(y) < LARGEST_M_S2
            ):  # False for NaN
                newest_s = sample.time_s
                ready.append((newest_s, x, y))
        self._fresh = later
        if not ready:
            return
        rows = np.array(ready)
        nearest = np.searchsorted(times_s, rows[:, 0]).clip(0, len(times_s) - 1)
        forces = horizontal_force(rows[:, 1:], quaternions[nearest])
        keep = self._times >= newest_s - WINDOW_S - LONGEST_GAP_S
        self._times = np.concatenate((self._times[keep], rows[:, 0]))
        self._forces = np.concatenate((self._forces[keep], forces))

    def newest_s(self, now_s: float) -> float | None:
        """Time of the newest sample where there is one every LONGEST_GAP_S up to `now_s`, all the window long."""
        times = self._times
        if len(times) < 3 or not 0.0 <= now_s - times[-1] < LONGEST_GAP_S:
            return None
        if times[0] > times[-1] - WINDOW_S + LONGEST_GAP_S or float(np.diff(times).max()) > LONGEST_GAP_S:
            return None
        return float(times[-1])

    def up_to(self, time_s: float) -> Array:
        """(FELT_SAMPLES, 2) [m/s^2] east and north, oldest first, every FELT_STEP_S up to `time_s`."""
        grid = time_s - _AGES
        return np.column_stack([np.interp(grid, self._times, self._forces[:, axis]) for axis in range(2)])

    def sigma_m_s2(self, density: float) -> float:
        """Noise of one sample on one axis, from the second differences, less what a walk of this density adds to them.

        Args:
            density: [m/s^2/sqrt(s)].
        """
        curvature = np.diff(self._forces, n=2, axis=0)
        walked = density**2 * float(np.diff(self._times).mean()) / 3.0
        return math.sqrt(max(0.0, float(np.mean(curvature**2)) / 6.0 - walked))


def horizontal_force(in_plane: Array, quaternions: Array) -> Array:
    """H (n, 2) [m/s^2], east and north, of specific forces (n, 2) along the body's x and y at attitudes (n, 4)."""
    w, x, y, z = quaternions.T
    f, g = in_plane.T
    east = (1.0 - 2.0 * (y * y + z * z)) * f + 2.0 * (x * y - w * z) * g
    north = 2.0 * (x * y + w * z) * f + (1.0 - 2.0 * (x * x + z * z)) * g
    up = 2.0 * (x * z - w * y) * f + 2.0 * (y * z + w * x) * g
    over = up / (1.0 - 2.0 * (x * x + y * y))
    return np.column_stack((east - 2.0 * (x * z + w * y) * over, north - 2.0 * (y * z - w * x) * over))
