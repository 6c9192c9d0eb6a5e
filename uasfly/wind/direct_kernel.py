"""Weights that turn the last second and a half of velocity and accelerometer into the force just now.

As in `force_kernel` the force is a random walk whose integral is seen with white noise; here it is also seen itself, by
an accelerometer with white noise and an unknown constant bias. The accelerometer tells what is fast, the integral what
is slow. So the force is known at once, about as well as the integral alone knows it a third of a second later.

Two samples of hindsight would take a tenth to a third off the error, and gusts, which change meanwhile, would more than
give it back: at 9 m/s the wind that is shown errs by 0.71 m/s without and by 0.83 m/s with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from uasfly.messages import Array
from uasfly.wind.force_kernel import SAMPLES, STEP_S, UNKNOWN, VELOCITY_NOISE_M_S

FELT_STEP_S = 0.02
FELT_SAMPLES = SAMPLES // 2
BIAS_M_S2 = 0.05  # sigma of what PX4's estimator leaves of the accelerometer's bias
LEAST_SIGMA_M_S2 = 0.03
_TIMES: Array = np.arange(SAMPLES, dtype=np.float64) * STEP_S
_FELT: Array = _TIMES[-1] - np.arange(FELT_SAMPLES, dtype=np.float64)[::-1] * FELT_STEP_S
LEVELS = 5  # of the accelerometer's noise, a factor of two apart: to 0.48 m/s^2; a noisier one is not worth its trouble


@dataclass(frozen=True, slots=True)
class DirectKernel:
    """One kernel.

    Attributes:
        of_integral: (SAMPLES,) [1/s], oldest first, every STEP_S up to the newest.
        of_felt: (FELT_SAMPLES,), oldest first, every FELT_STEP_S up to the newest.
        variance: of the estimate's error, one axis [m^2/s^4].
    """

    of_integral: Array
    of_felt: Array
    variance: float


def level_of(sigma_m_s2: float) -> int | None:
    """Which level of noise an accelerometer's sigma [m/s^2] belongs to; None where it is too noisy."""
    level = max(0, round(float(np.log2(max(sigma_m_s2, LEAST_SIGMA_M_S2) / LEAST_SIGMA_M_S2))))
    return level if level < LEVELS else None


@lru_cache(maxsize=128)
def direct_kernel(density: float, level: int) -> DirectKernel:
    """The kernel for a density [m/s^2/sqrt(s)] and a level of the accelerometer's noise."""
    sigma = LEAST_SIGMA_M_S2 * 2.0**level
    noise = np.zeros((SAMPLES + FELT_SAMPLES, SAMPLES + FELT_SAMPLES))
    noise[:SAMPLES, :SAMPLES] = VELOCITY_NOISE_M_S**2 * np.eye(SAMPLES)
    noise[SAMPLES:, SAMPLES:] = sigma**2 * np.eye(FELT_SAMPLES) + BIAS_M_S2**2
    seen, told = _walk()
    unknown_seen, unknown_told = _unknown()
    squared = density**2
    weights: Array = np.linalg.solve(squared * seen + unknown_seen + noise, squared * told + unknown_told).astype(float)
    of_integral = weights[:SAMPLES] - weights[:SAMPLES].mean()  # what the large variances cost in rounding:
    left = 1.0 - float(of_integral @ _TIMES) - float(weights[SAMPLES:].sum())
    of_felt: Array = weights[SAMPLES:] + left / FELT_SAMPLES  # a steady force comes out as it is
    weights = np.concatenate((of_integral, of_felt))
    walked = squared * (float(_TIMES[-1]) - 2.0 * float(weights @ told) + float(weights @ seen @ weights))
    return DirectKernel(of_integral, of_felt, walked + float(weights @ noise @ weights))


@lru_cache(maxsize=1)
def _walk() -> tuple[Array, Array]:
    """Covariances of all that is seen, and of it with what is told, for a walk of density 1 from zero."""
    earlier = np.minimum.outer(_TIMES, _TIMES)
    product, total = np.multiply.outer(_TIMES, _TIMES), np.add.outer(_TIMES, _TIMES)
    integrals = product * earlier - total * earlier**2 / 2.0 + earlier**3 / 3.0
    forces = np.append(_FELT, _TIMES[-1])
    passed = np.minimum.outer(_TIMES, forces)
    mixed = _TIMES[:, None] * passed - passed**2 / 2.0
    among = np.minimum.outer(_FELT, forces)
    seen = np.block([[integrals, mixed[:, :-1]], [mixed[:, :-1].T, among[:, :-1]]])
    return seen, np.concatenate((mixed[:, -1], among[:, -1]))


@lru_cache(maxsize=1)
def _unknown() -> tuple[Array, Array]:
    """The same for what is not known beforehand: the integral's and the force's first values."""
    by_force = np.concatenate((_TIMES, np.ones(FELT_SAMPLES)))
    by_integral = np.concatenate((np.ones(SAMPLES), np.zeros(FELT_SAMPLES)))
    seen = UNKNOWN**2 * (np.multiply.outer(by_force, by_force) + np.multiply.outer(by_integral, by_integral))
    return seen, UNKNOWN**2 * by_force
