"""Dryden gusts: parameters, filters, their discretisation and their spectra."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import welch

from tests.sim_wind.spectra import dryden_spectra
from uasfly.messages import Array
from uasfly.sim.wind.dryden import (
    RENEWAL,
    DrydenGusts,
    LongitudinalFilter,
    TransverseFilter,
    low_altitude_parameters,
)

Filter = LongitudinalFilter | TransverseFilter


def exact_hold(A: Array, B: Array, step_s: float) -> tuple[Array, Array]:
    """Discrete A and B of x' = A x + B u under a held input, from one matrix exponential."""
    n = len(A)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:] = A, B
    block = expm(block * step_s)
    return block[:n, :n], block[:n, n:]


def test_parameters_follow_the_formulas_in_feet() -> None:
    """At 100 ft and W20 = 30: 0.2593^1.2 = 0.19793, so L_u = 505.2 ft; sigma_w = 3, sigma_u = 3 / 0.2593^0.4."""
    parameters = low_altitude_parameters(100 * 0.3048, 30.0)
    base = 0.177 + 0.0823
    assert parameters.length_u_m == pytest.approx(505.2 * 0.3048, rel=1e-3)
    assert parameters.length_u_m == parameters.length_v_m == pytest.approx(100.0 / base**1.2 * 0.3048, rel=1e-12)
    assert parameters.length_w_m == pytest.approx(30.48, rel=1e-12)
    assert parameters.sigma_w_m_s == pytest.approx(3.0)
    assert parameters.sigma_u_m_s == parameters.sigma_v_m_s == pytest.approx(3.0 / base**0.4, rel=1e-12)


def test_turbulence_is_isotropic_at_the_top_of_the_low_altitude_model() -> None:
    """At 1000 ft the formulas give L_u = L_w and sigma_u = sigma_w (0.177 + 0.823 = 1), and stay there above."""
    top = low_altitude_parameters(304.8, 10.0)
    assert top.length_u_m == pytest.approx(top.length_w_m, rel=1e-12)
    assert top.sigma_u_m_s == pytest.approx(top.sigma_w_m_s, rel=1e-12)
    assert low_altitude_parameters(2000.0, 10.0) == top


def test_height_is_held_at_one_metre_near_the_ground() -> None:
    """Below 1 m, on the ground and under it the parameters are those of 1 m: no length scale becomes zero."""
    floor = low_altitude_parameters(1.0, 10.0)
    assert low_altitude_parameters(0.0, 10.0) == low_altitude_parameters(-5.0, 10.0) == floor
    assert floor.length_w_m == 1.0
    assert low_altitude_parameters(1.5, 10.0).length_w_m == 1.5


@pytest.mark.parametrize("step_s", [0.001, 0.004, 0.1])
@pytest.mark.parametrize("time_constant_s", [0.15, 2.0])
def test_longitudinal_filter_matches_the_matrix_exponential(time_constant_s: float, step_s: float) -> None:
    """A held input through H_u with unit sigma gives the same values as the matrix exponential of its state space."""
    rng = np.random.default_rng(1)
    A, B = exact_hold(np.array([[-1 / time_constant_s]]), np.array([[1 / time_constant_s]]), step_s)
    gain = math.sqrt(2 * time_constant_s / math.pi)
    tested = LongitudinalFilter()
    tested.tune(time_constant_s, step_s)
    state = np.zeros((1, 1))
    for noise in rng.standard_normal(200).tolist():
        state = A @ state + B * noise * math.sqrt(math.pi / step_s)
        assert tested.step(noise) == pytest.approx(gain * state[0, 0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("step_s", [0.001, 0.004, 0.1])
@pytest.mark.parametrize("time_constant_s", [0.15, 2.0])
def test_transverse_filter_matches_the_matrix_exponential(time_constant_s: float, step_s: float) -> None:
    """A held input through H_v with unit sigma gives the same values as the exponential of its canonical form."""
    rng = np.random.default_rng(2)
    T = time_constant_s
    A, B = exact_hold(np.array([[0.0, 1.0], [-1 / T**2, -2 / T]]), np.array([[0.0], [1.0]]), step_s)
    output = math.sqrt(T / math.pi) * np.array([[1 / T**2, math.sqrt(3) * T / T**2]])
    tested = TransverseFilter()
    tested.tune(T, step_s)
    state = np.zeros((2, 1))
    for noise in rng.standard_normal(200).tolist():
        state = A @ state + B * noise * math.sqrt(math.pi / step_s)
        assert tested.step(noise) == pytest.approx((output @ state)[0, 0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", [LongitudinalFilter, TransverseFilter])
def test_filters_have_unit_variance(kind: type[Filter]) -> None:
    """The squared impulse response at 4 ms sums to 1 within 0.1 %: sigma alone scales the gust."""
    tested = kind()
    tested.tune(0.5, 0.004)
    response = [tested.step(1.0)] + [tested.step(0.0) for _ in range(5000)]
    assert sum(value * value for value in response) == pytest.approx(1.0, rel=1e-3)


def test_filters_are_stationary_from_the_first_step() -> None:
    """Started with standard normal numbers, both filters have unit variance and the right correlation at once."""
    rng = np.random.default_rng(3)
    first, later = [], []
    for a, b, c in rng.standard_normal((20000, 3)).tolist():
        u, v = LongitudinalFilter(a), TransverseFilter(b, c)
        u.tune(1.0, 1e-6)
        v.tune(1.0, 1e-6)
        first.append((u.step(0.0), v.step(0.0)))
        u.tune(1.0, 0.5)
        v.tune(1.0, 0.5)
        later.append((u.step(0.0), v.step(0.0)))
    start, end = np.array(first), np.array(later)
    assert start.var(axis=0) == pytest.approx((1.0, 1.0), rel=0.04)
    # Autocorrelation at 0.5 T: exp(-0.5) along the wind, exp(-0.5) (1 - 0.5/2) across it (Dryden's g = f (1 - x/2L)).
    assert (start * end).mean(axis=0) == pytest.approx((math.exp(-0.5), 0.75 * math.exp(-0.5)), abs=0.03)


@pytest.mark.parametrize("kind", [LongitudinalFilter, TransverseFilter])
def test_a_new_time_constant_makes_no_jump_and_keeps_the_variance(kind: type[Filter]) -> None:
    """Switching the time constant between 0.2 s and 2 s all the time leaves the gust continuous, its variance 1."""
    rng = np.random.default_rng(4)
    tested = kind(*rng.standard_normal(2 if kind is TransverseFilter else 1).tolist())
    values = []
    for index, noise in enumerate(rng.standard_normal(300_000).tolist()):
        if index % 50 == 0:
            tested.tune(0.2 if index % 100 == 0 else 2.0, 0.004)
        values.append(tested.step(noise))
    gust = np.array(values)
    jumps = np.abs(np.diff(gust))
    assert gust.var() == pytest.approx(1.0, rel=0.1)
    assert jumps[49::50].max() <= jumps.max()
    assert jumps[49::50].mean() == pytest.approx(jumps.mean(), rel=0.1)


def test_flown_gusts_have_the_spectra_of_the_specification() -> None:
    """Gusts met at 10 m height and 10 m/s have MIL-F-8785C's spectra within 5 % in bands from 0.02 to 2 Hz."""
    step_s, height_m, speed_m_s, w20_m_s = 0.05, 10.0, 10.0, 7.7
    gusts = DrydenGusts(w20_m_s, np.random.default_rng(5), step_s)
    record = np.array([gusts.step(height_m, speed_m_s) for _ in range(600_000)])
    frequency, measured = welch(record, fs=1 / step_s, nperseg=4096, axis=0)
    theory = dryden_spectra(frequency, low_altitude_parameters(height_m, w20_m_s), speed_m_s)
    for low, high in ((0.02, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 2.0)):
        band = (frequency >= low) & (frequency < high)
        ratio = (measured[band] / theory[band]).mean(axis=0)
        assert ratio == pytest.approx(np.ones(3), abs=0.05), (low, high)


def test_flown_gusts_have_the_sigmas_of_the_specification() -> None:
    """Standard deviations over 30 000 s are within 3 % of theory; the components are uncorrelated."""
    gusts = DrydenGusts(7.7, np.random.default_rng(6), 0.1)
    record = np.array([gusts.step(2.0, 6.0) for _ in range(300_000)])
    expected = low_altitude_parameters(2.0, 7.7)
    assert record.std(axis=0) == pytest.approx(
        (expected.sigma_u_m_s, expected.sigma_v_m_s, expected.sigma_w_m_s), rel=0.03
    )
    assert np.corrcoef(record.T) == pytest.approx(np.eye(3), abs=0.05)


@pytest.mark.parametrize(("climb_m", "speedup_m_s"), [(0.02, 0.0), (0.0, 0.02), (0.004, 0.005)])
def test_parameters_follow_height_and_airspeed(climb_m: float, speedup_m_s: float) -> None:
    """While the vehicle climbs or speeds up, a gust is that of filters tuned at every step, within 2 %."""
    step_s, w20_m_s = 0.004, 8.0
    gusts = DrydenGusts(w20_m_s, np.random.default_rng(7), step_s)
    draws = np.random.default_rng(7).standard_normal((1024, 3)).tolist()
    (a, b, c), (d, e, _) = draws[:2]
    u, v, w = LongitudinalFilter(a), TransverseFilter(b, c), TransverseFilter(d, e)
    for index, (noise_u, noise_v, noise_w) in enumerate(draws[2:]):
        height, speed = 1.5 + climb_m * index, 3.0 + speedup_m_s * index
        exact = low_altitude_parameters(height, w20_m_s)
        u.tune(exact.length_u_m / speed, step_s)
        v.tune(exact.length_v_m / speed, step_s)
        w.tune(exact.length_w_m / speed, step_s)
        expected = (
            exact.sigma_u_m_s * u.step(noise_u),
            exact.sigma_v_m_s * v.step(noise_v),
            exact.sigma_w_m_s * w.step(noise_w),
        )
        assert gusts.step(height, speed) == pytest.approx(expected, abs=2.0 * RENEWAL * exact.sigma_u_m_s)


def test_slow_air_does_not_freeze() -> None:
    """Drifting with the wind (airspeed 0) the gusts change as at 1 m/s, and stay finite."""
    drifting = DrydenGusts(8.0, np.random.default_rng(8), 0.004)
    slow = DrydenGusts(8.0, np.random.default_rng(8), 0.004)
    for _ in range(1000):
        assert drifting.step(2.0, 0.0) == slow.step(2.0, 1.0)
