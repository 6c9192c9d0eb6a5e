"""Weights that turn the last second and a half of a noisy integral into the force a third of a second ago.

The force is taken as a random walk of density q, its integral is seen with white noise: the best estimate is a weighted
sum of what was seen, the same as a Kalman smoother's with a fixed lag (Rasmussen & Williams 2006, *Gaussian Processes
for Machine Learning*, eq. 2.23 and 2.24; Anderson & Moore 1979, *Optimal Filtering*, section 7.3). A force that is told
at once lags behind gusts, or is noisy; the lag, said openly, halves the error of both.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from uasfly.messages import Array

STEP_S = 0.01  # of the grid that the kernel works on
SAMPLES = 150
LAG = 30  # samples: 0.3 s
LAG_S = LAG * STEP_S
WINDOW_S = (SAMPLES - 1) * STEP_S
VELOCITY_NOISE_M_S = 0.02  # of one sample on the grid: PX4's velocity, as the scenarios and its own simulator have it
UNKNOWN = 1e3  # standard deviation of what is not known beforehand: the integral's and the force's first values


@dataclass(frozen=True, slots=True)
class ForceKernel:
    """One kernel.

    Attributes:
        density: of the random walk [m/s^2/sqrt(s)].
        weights: (SAMPLES,) [1/s], oldest first; they sum to zero.
        variance: of the estimate's error, one axis [m^2/s^4].
    """

    density: float
    weights: Array
    variance: float


def force_kernel(density: float) -> ForceKernel:
    """The kernel for a density [m/s^2/sqrt(s)], greater than 0."""
    times = np.arange(SAMPLES) * STEP_S
    then = times[SAMPLES - 1 - LAG]
    earlier = np.minimum.outer(times, times)
    product, total = np.multiply.outer(times, times), np.add.outer(times, times)
    # Covariances of the integral with itself and with the force, for a walk that starts from zero.
    walk = density**2 * (product * earlier - total * earlier**2 / 2.0 + earlier**3 / 3.0)
    passed = np.minimum(then, times)
    cross = density**2 * (times * passed - passed**2 / 2.0) + UNKNOWN**2 * times
    unknown = UNKNOWN**2 * (1.0 + product)
    seen = walk + unknown + VELOCITY_NOISE_M_S**2 * np.eye(SAMPLES)
    weights = np.linalg.solve(seen, cross)
    weights -= weights.mean()  # what the large variances cost in rounding
    noise = VELOCITY_NOISE_M_S**2 * float(weights @ weights)
    walked = density**2 * then - 2.0 * float(weights @ (cross - UNKNOWN**2 * times)) + float(weights @ walk @ weights)
    return ForceKernel(density, weights, noise + walked)


@lru_cache(maxsize=1)
def kernels() -> tuple[ForceKernel, ...]:
    """Kernels for densities from 0.02 to 5.1 m/s^2/sqrt(s), a factor of two apart: calm air to storm."""
    return tuple(force_kernel(0.02 * 2.0**k) for k in range(9))
