"""Dryden gusts against two other implementations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.signal import welch

from tests.data import test_data as reference_data
from tests.sim_wind.spectra import dryden_spectra
from uasfly.messages import Array
from uasfly.sim.wind.dryden import LongitudinalFilter, TransverseFilter, low_altitude_parameters


def test_filters_reproduce_the_mathworks_block() -> None:
    """Fed with the noise of the MathWorks block (h 5 m, V 10 m/s, W20 15 m/s, 1 kHz) the filters give its u, v, w."""
    noise = np.loadtxt(reference_data("data/wind/matlab_dryden_noise_in.csv"), delimiter=",", skiprows=1)
    golden = np.loadtxt(reference_data("data/wind/matlab_dryden_uvw_out.csv"), delimiter=",", skiprows=1)
    step_s, speed_m_s = 0.001, 10.0
    parameters = low_altitude_parameters(5.0, 15.0)
    u, v, w = LongitudinalFilter(), TransverseFilter(), TransverseFilter()
    u.tune(parameters.length_u_m / speed_m_s, step_s)
    v.tune(parameters.length_v_m / speed_m_s, step_s)
    w.tune(parameters.length_w_m / speed_m_s, step_s)
    unit = (noise[:, 1:4] / math.sqrt(math.pi / step_s)).tolist()
    ours = np.zeros_like(golden[:, 1:4])
    for index, (noise_u, noise_v, noise_w) in enumerate(unit[:-1]):
        ours[index + 1] = (
            parameters.sigma_u_m_s * u.step(noise_u),
            parameters.sigma_v_m_s * v.step(noise_v),
            parameters.sigma_w_m_s * w.step(noise_w),
        )
    assert len(golden) == 5001
    assert np.abs(golden[:, 1:4]).max() > 1.0
    assert np.abs(ours - golden[:, 1:4]).max() < 1e-6


def test_jsbsim_record_has_our_sigmas() -> None:
    """The variances of 600 s of JSBSim's turbulence (h 10 m, W20 7.7 m/s) differ from ours by chance only.

    A record of duration T of a process with one-sided density S has a variance with sampling error
    sqrt(integral of S^2 / T) (Bendat & Piersol): here 17, 14 and 5 %; two of them are the bound.
    """
    record = jsbsim_record()
    parameters = low_altitude_parameters(10.0, 7.7)
    sigmas = np.array((parameters.sigma_u_m_s, parameters.sigma_v_m_s, parameters.sigma_w_m_s))
    frequency = np.linspace(0.0, 25.0, 250_001)
    sampling_error = np.sqrt(trapezoid(dryden_spectra(frequency, parameters, 7.7) ** 2, frequency, axis=0) / 600.0)
    assert (np.abs(record.var(axis=0) - sigmas**2) < 2.0 * sampling_error).all()


def test_jsbsim_record_has_our_spectra() -> None:
    """JSBSim's spectra agree with ours within 5 % from 0.1 to 5 Hz (above, its bilinear filters fall off)."""
    frequency, measured = welch(jsbsim_record(), fs=50.0, nperseg=4096, axis=0)
    theory = dryden_spectra(frequency, low_altitude_parameters(10.0, 7.7), 7.7)
    band = (frequency >= 0.1) & (frequency <= 5.0)
    assert (measured / theory)[band].mean(axis=0) == pytest.approx(np.ones(3), abs=0.05)


def jsbsim_record() -> Array:
    """Gusts (30000, 3) [m/s] at 50 Hz: along the mean wind, across it and vertical."""
    file = np.load(reference_data("data/wind/jsbsim_ttTustin_h10m_W20_7p7_50Hz_600s.npz"))
    record: Array = file["uvw_ned"].astype(np.float64)
    return record
