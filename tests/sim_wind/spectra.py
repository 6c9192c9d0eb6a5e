"""Dryden spectra of MIL-F-8785C, for the tests to compare with."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.sim.wind.dryden import DrydenParameters


def dryden_spectra(frequency_hz: Array, parameters: DrydenParameters, airspeed_m_s: float) -> Array:
    """One-sided power spectral densities (n, 3) of u, v, w [(m/s)^2/Hz] at (n,) frequencies.

    The specification gives Phi(Omega) over spatial frequency Omega [rad/m], for Omega > 0:
    Phi_u = sigma^2 (2 L/pi) / (1 + (L Omega)^2), Phi_v = sigma^2 (L/pi) (1 + 3 (L Omega)^2) / (1 + (L Omega)^2)^2;
    with Omega = 2 pi f / V a density over f is Phi * 2 pi / V.
    """
    omega = 2 * math.pi * np.asarray(frequency_hz) / airspeed_m_s

    def longitudinal(sigma: float, length: float) -> Array:
        return sigma**2 * 2 * length / math.pi / (1 + (length * omega) ** 2)

    def transverse(sigma: float, length: float) -> Array:
        square = (length * omega) ** 2
        return sigma**2 * length / math.pi * (1 + 3 * square) / (1 + square) ** 2

    columns = (
        longitudinal(parameters.sigma_u_m_s, parameters.length_u_m),
        transverse(parameters.sigma_v_m_s, parameters.length_v_m),
        transverse(parameters.sigma_w_m_s, parameters.length_w_m),
    )
    return np.stack(columns, axis=1) * 2 * math.pi / airspeed_m_s
