"""Weights for the force just now, from velocity and accelerometer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.wind.direct_kernel import (
    BIAS_M_S2,
    FELT_SAMPLES,
    FELT_STEP_S,
    LEAST_SIGMA_M_S2,
    LEVELS,
    direct_kernel,
    level_of,
)
from uasfly.wind.force_kernel import SAMPLES, STEP_S, VELOCITY_NOISE_M_S, force_kernel, kernels

TIMES = np.arange(SAMPLES) * STEP_S


@pytest.mark.parametrize("level", range(LEVELS))
def test_a_steady_force_comes_out_as_it_is(level: int) -> None:
    """Whatever the integral began with, for every density."""
    for kernel in (direct_kernel(one.density, level) for one in kernels()):
        told = kernel.of_integral @ (7.0 + 0.8 * TIMES) + kernel.of_felt @ np.full(FELT_SAMPLES, 0.8)
        assert told == pytest.approx(0.8, abs=1e-6)


@pytest.mark.parametrize(("density", "level"), [(0.08, 2), (0.64, 2), (2.56, 1), (1.28, 4)])
def test_the_variance_is_what_walks_noise_and_bias_show(density: float, level: int) -> None:
    """2000 random walks: mean squared error within 10 % of the variance (3 sigma)."""
    rng = np.random.default_rng(5)
    fine, sigma = 4, LEAST_SIGMA_M_S2 * 2.0**level
    walk = 3.0 + np.cumsum(density * np.sqrt(STEP_S / fine) * rng.standard_normal((2000, SAMPLES * fine)), axis=1)
    seen = np.cumsum(walk, axis=1)[:, fine - 1 :: fine] * STEP_S / fine
    seen += VELOCITY_NOISE_M_S * rng.standard_normal(seen.shape)
    at_samples = walk[:, fine - 1 :: fine]
    every = round(FELT_STEP_S / STEP_S)
    felt = at_samples[:, ::-1][:, : every * FELT_SAMPLES : every][:, ::-1]
    felt = felt + sigma * rng.standard_normal(felt.shape) + BIAS_M_S2 * rng.standard_normal((2000, 1))
    kernel = direct_kernel(density, level)
    error = seen @ kernel.of_integral + felt @ kernel.of_felt - at_samples[:, -1]
    assert np.mean(error**2) == pytest.approx(kernel.variance, rel=0.1)


def test_in_gusts_it_knows_now_what_velocity_alone_knows_later() -> None:
    """With a healthy vehicle's accelerometer (0.12 m/s^2); in calm air, which hardly changes, its sigma is larger."""
    for one in kernels():
        ratio = math.sqrt(direct_kernel(one.density, 2).variance / force_kernel(one.density).variance)
        assert ratio < (1.0 if one.density >= 0.6 else 1.65)


def test_a_noisy_accelerometer_is_not_used() -> None:
    """Levels are a factor of two apart, and end."""
    assert [level_of(sigma) for sigma in (0.0, 0.03, 0.06, 0.12, 0.48)] == [0, 0, 1, 2, 4]
    assert level_of(1.0) is None
