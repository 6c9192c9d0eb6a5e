"""Gusts as a sum of sines (Waslander & Wang 2009): u along the mean wind, v to its left, w up.

    v(t) = v0 + sum_i a_i sin(Omega_i t + phi_i),  a_i = sqrt(dOmega_i PSD(Omega_i)),  Omega_i in 0.1 .. 1.5 rad/s

with the Dryden densities of MIL-F-8785C at low altitude,

    PSD_h = sigma_h^2 (2 L_h/pi) / (1 + (L_h Omega)^2) along both horizontal axes,
    PSD_v = sigma_v^2 (L_v/pi) (1 + 3 (L_v Omega)^2) / (1 + (L_v Omega)^2)^2 upright.

Taken as the paper writes it, which has two consequences. The densities are over spatial frequency [rad/m] and are read
at temporal ones [rad/s], as if air passed at 1 m/s. And a sine of amplitude a has the power a^2/2, so the gusts carry
half the power of the density in the band, and none outside it: at 2 m height 0.41 of sigma_h and 0.56 of sigma_v. The
filters (`dryden`) have all of it. The paper does not say how many sines it adds or how it draws their frequencies: here
the band is cut into `SINES` equal parts, and each has one at a random frequency, so that no part is left empty.
"""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.sim.wind.dryden import HIGHEST_HEIGHT_M, LOWEST_HEIGHT_M, RENEWAL, low_altitude_parameters

SINES = 20  # on each axis
LOWEST_RAD_S, HIGHEST_RAD_S = 0.1, 1.5


def horizontal_density(omega: Array, sigma_m_s: float, length_m: float) -> Array:
    """PSD_h [m^2/s^2 per unit of Omega] at frequencies (...,), one-sided: over Omega > 0 it integrates to sigma^2."""
    return np.asarray(sigma_m_s**2 * (2.0 * length_m / math.pi) / (1.0 + (length_m * omega) ** 2))


def vertical_density(omega: Array, sigma_m_s: float, length_m: float) -> Array:
    """PSD_v, likewise."""
    square = (length_m * omega) ** 2
    return np.asarray(sigma_m_s**2 * (length_m / math.pi) * (1.0 + 3.0 * square) / (1.0 + square) ** 2)


class SumOfSines:
    """Gusts that are a function of time alone; height changes how strong they are, not their phases.

    Everything random is drawn at the beginning: two controllers on one seed meet the same gusts.

    Args:
        w20_m_s: mean wind speed at 20 ft [m/s].
        rng: source of frequencies and phases.
        step_s: time between two calls of `step` [s].
    """

    def __init__(self, w20_m_s: float, rng: np.random.Generator, step_s: float) -> None:
        self._w20_m_s = w20_m_s
        self._step_s = step_s
        self._width = (HIGHEST_RAD_S - LOWEST_RAD_S) / SINES
        places = np.arange(SINES) + rng.random((3, SINES))
        self.omega_rad_s: Array = LOWEST_RAD_S + self._width * places
        self._phases_rad = rng.uniform(0.0, 2.0 * math.pi, (3, SINES))
        self._amplitudes_m_s = np.zeros((3, SINES))
        self._height_m = 0.0
        self._steps = 0

    def step(self, height_m: float, airspeed_m_s: float) -> tuple[float, float, float]:  # noqa: ARG002
        """Gust (u, v, w) [m/s] one step later, at a height above the ground [m]; the airspeed plays no part."""
        height = min(max(height_m, LOWEST_HEIGHT_M), HIGHEST_HEIGHT_M)
        if abs(height - self._height_m) > RENEWAL * self._height_m:
            self._height_m = height
            self._amplitudes_m_s = self.amplitudes_m_s(height)
        self._steps += 1
        waves = np.sin(self.omega_rad_s * (self._steps * self._step_s) + self._phases_rad)
        u, v, w = np.einsum("ij,ij->i", self._amplitudes_m_s, waves).tolist()
        return u, v, w

    def amplitudes_m_s(self, height_m: float) -> Array:
        """The a_i (3, n) [m/s] of u, v and w at a height [m]."""
        figures = low_altitude_parameters(height_m, self._w20_m_s)
        density = np.empty_like(self.omega_rad_s)
        density[:2] = horizontal_density(self.omega_rad_s[:2], figures.sigma_u_m_s, figures.length_u_m)
        density[2] = vertical_density(self.omega_rad_s[2], figures.sigma_w_m_s, figures.length_w_m)
        return np.asarray(np.sqrt(self._width * density))
