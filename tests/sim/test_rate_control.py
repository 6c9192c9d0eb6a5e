from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.signal import butter, lfilter

from uasfly.sim.rate_control import (
    RateGains,
    butterworth_coefficients,
    filter_gyro,
    low_pass_share,
    next_integral,
    rate_pid,
)

GAINS = RateGains(
    ca.SX(ca.DM((0.15, 0.15, 0.2))),
    ca.SX(ca.DM((0.2, 0.2, 0.1))),
    ca.SX(ca.DM((0.003, 0.003, 0.0))),
    ca.SX(ca.DM((0.3, 0.3, 0.3))),
)


def evaluated(expression: ca.SX) -> np.ndarray:
    """Numbers of a constant expression."""
    return np.array(ca.evalf(expression)).squeeze()


def vector(*values: float) -> ca.SX:
    """A constant."""
    return ca.SX(ca.DM(values))


@pytest.mark.parametrize("cutoff", [10.0, 40.0, 80.0])
def test_gyro_filter_is_scipys_butterworth(cutoff: float) -> None:
    """The recursive filter gives what scipy's Butterworth of second order gives."""
    signal = np.random.default_rng(1).standard_normal(200)
    numerator, denominator = butter(2, cutoff, fs=250.0)
    memory, ours = ca.SX.zeros(6), []
    coefficients = vector(*butterworth_coefficients(cutoff, 0.004))
    for value in signal:
        filtered, memory = filter_gyro(memory, vector(value, 0.0, 0.0), coefficients)
        ours.append(float(evaluated(filtered)[0]))
    assert ours == pytest.approx(lfilter(numerator, denominator, signal))


def test_cutoffs_beyond_the_nyquist_rate_stay_stable() -> None:
    """Senseless cut-offs are brought into what 250 Hz can do."""
    for cutoff in (-5.0, 0.0, 1e6):
        _, a1, a2 = butterworth_coefficients(cutoff, 0.004)
        assert np.abs(np.roots([1.0, a1, a2])).max() < 1.0
        assert 0.0 < low_pass_share(cutoff, 0.004) <= 1.0


def test_torque_is_the_sum_of_the_three_terms() -> None:
    """P on the error, I as it is, D against the measured acceleration."""
    torque = rate_pid(vector(1.0, -1.0, 0.5), vector(10.0, 0.0, 10.0), vector(0.01, 0.02, 0.03), GAINS)
    assert evaluated(torque) == pytest.approx([0.15 + 0.01 - 0.03, -0.15 + 0.02, 0.1 + 0.03])


def test_the_integral_grows_stops_and_is_bounded() -> None:
    """It grows with the error, not into saturation, not on the ground, and not beyond its limit."""
    error, none, flying = vector(1.0, 1.0, -1.0), vector(0.0, 0.0, 0.0), ca.SX(1.0)
    grown = evaluated(next_integral(error, none, none, GAINS, flying, 0.01))
    assert grown == pytest.approx([0.002, 0.002, -0.001])
    saturated = evaluated(next_integral(error, none, vector(1.0, -1.0, -1.0), GAINS, flying, 0.01))
    assert saturated == pytest.approx([0.0, 0.002, 0.0])
    assert evaluated(next_integral(error, none, none, GAINS, ca.SX(0.0), 0.01)) == pytest.approx(np.zeros(3))
    assert evaluated(next_integral(error, vector(0.3, 0.2999, -0.3), none, GAINS, flying, 0.01)) == pytest.approx(
        [0.3, 0.3, -0.3]
    )
