"""Weights for the force a third of a second ago."""

from __future__ import annotations

import numpy as np
import pytest

from uasfly.wind.force_kernel import LAG, SAMPLES, STEP_S, VELOCITY_NOISE_M_S, force_kernel, kernels


@pytest.mark.parametrize("kernel", kernels(), ids=lambda kernel: f"{kernel.density:g}")
def test_a_steady_force_comes_out_as_it_is(kernel: object) -> None:
    """Whatever the integral began with, for every density."""
    times = np.arange(SAMPLES) * STEP_S
    assert kernel.weights @ (7.0 + 0.8 * times) == pytest.approx(0.8, abs=1e-6)  # type: ignore[attr-defined]


@pytest.mark.parametrize("density", [0.05, 0.5, 3.0])
def test_the_variance_is_what_walks_and_noise_show(density: float) -> None:
    """2000 random walks, seen through white noise: mean squared error within 10 % of the variance (3 sigma)."""
    rng = np.random.default_rng(5)
    fine = 4  # steps of the walk between two samples
    steps = density * np.sqrt(STEP_S / fine) * rng.standard_normal((2000, SAMPLES * fine))
    walk = 3.0 + np.cumsum(steps, axis=1)
    seen = np.cumsum(walk, axis=1)[:, fine - 1 :: fine] * STEP_S / fine
    seen += VELOCITY_NOISE_M_S * rng.standard_normal(seen.shape)
    kernel = force_kernel(density)
    error = seen @ kernel.weights - walk[:, (SAMPLES - LAG) * fine - 1]
    assert np.mean(error**2) == pytest.approx(kernel.variance, rel=0.1)


def test_calm_air_is_looked_at_longer() -> None:
    """The less the force walks, the better it is known."""
    variances = [kernel.variance for kernel in kernels()]
    assert variances == sorted(variances)
    assert kernels()[0].density == 0.02
