"""Dryden gusts of MIL-F-8785C at low altitude: u along the mean wind, v to its left, w up.

The specification's filters, driven by white noise of power pi per Hz (V: air-relative speed, s: Laplace variable):

    H_u = sigma_u sqrt(2 L_u / (pi V)) / (1 + s L_u/V)
    H_v = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) s L_v/V) / (1 + s L_v/V)^2, H_w likewise

discretised exactly for an input held over a step (zero-order hold) of variance pi / step. The states are scaled so that
their stationary variance depends on nothing: when height or speed change, the gusts go on without a jump and with the
right sigma.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.sim.wind.noise import NormalTriples

FOOT_M = 0.3048

# The specification's low-altitude model holds from 10 ft to 1000 ft. Multirotors fly lower: its formulas are carried on
# down to 1 m (length scales shrink with height, as near any wall) and held there, so that time constants stay positive.
LOWEST_HEIGHT_M = 1.0
HIGHEST_HEIGHT_M = 1000.0 * FOOT_M

# A vehicle that drifts with the wind would meet frozen air (infinite time constants); real air changes by itself.
LOWEST_AIRSPEED_M_S = 1.0

# Coefficients are renewed when height or airspeed have changed by this much since the last time.
RENEWAL = 0.02

_SQRT3 = math.sqrt(3.0)


@dataclass(frozen=True, slots=True)
class DrydenParameters:
    """Length scales [m] and intensities [m/s] of the three gust components."""

    length_u_m: float
    length_v_m: float
    length_w_m: float
    sigma_u_m_s: float
    sigma_v_m_s: float
    sigma_w_m_s: float


def low_altitude_parameters(height_m: float, w20_m_s: float) -> DrydenParameters:
    """Parameters at a height above the ground, limited to 1 m .. 1000 ft (MIL-F-8785C, section 3.7.3; there h in feet).

    L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2,
    sigma_w = 0.1 W20, sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4.

    Args:
        height_m: height above the ground [m].
        w20_m_s: mean wind speed at 20 ft [m/s].
    """
    height_m = min(max(height_m, LOWEST_HEIGHT_M), HIGHEST_HEIGHT_M)
    base = 0.177 + 0.000823 * (height_m / FOOT_M)
    length_m = height_m / base**1.2
    sigma_w = 0.1 * w20_m_s
    sigma = sigma_w / base**0.4
    return DrydenParameters(length_m, length_m, height_m, sigma, sigma, sigma_w)


class LongitudinalFilter:
    """H_u with unit sigma: x' = -x/T + sqrt(2/T) noise, T = L_u / V; x has unit variance.

    Args:
        state: value to start from; a standard normal number makes it stationary from the first step.
    """

    __slots__ = ("_decay", "_drive", "_state")

    def __init__(self, state: float = 0.0) -> None:
        self._state = state
        self._decay = 1.0
        self._drive = 0.0

    def tune(self, time_constant_s: float, step_s: float) -> None:
        """Set T and the step [s]; the state stays."""
        self._decay = math.exp(-step_s / time_constant_s)
        self._drive = (1.0 - self._decay) * math.sqrt(2.0 * time_constant_s / step_s)

    def step(self, noise: float) -> float:
        """Value one step later under a standard normal number."""
        self._state = self._decay * self._state + self._drive * noise
        return self._state


class TransverseFilter:
    """H_v (or H_w) with unit sigma, T = L_v / V.

    a' = -a/T + noise/sqrt(T), b' = (a - b)/T, output sqrt(3) a + (1 - sqrt(3)) b. Stationary moments: E a^2 = 1/2,
    E ab = E b^2 = 1/4, so the output has unit variance.

    Args:
        first, second: standard normal numbers make it stationary from the first step; zeros start it at rest.
    """

    __slots__ = ("_decay", "_drive_a", "_drive_b", "_feed", "_state_a", "_state_b")

    def __init__(self, first: float = 0.0, second: float = 0.0) -> None:
        self._state_a = math.sqrt(0.5) * first
        self._state_b = 0.5 * self._state_a + math.sqrt(0.125) * second
        self._decay = 1.0
        self._feed = self._drive_a = self._drive_b = 0.0

    def tune(self, time_constant_s: float, step_s: float) -> None:
        """Set T and the step [s]; the states stay."""
        ratio = step_s / time_constant_s
        scale = 1.0 / math.sqrt(ratio)  # T/sqrt(T) of the input times 1/sqrt(step) of the held noise
        self._decay = math.exp(-ratio)
        self._feed = ratio * self._decay
        self._drive_a = (1.0 - self._decay) * scale
        self._drive_b = (1.0 - self._decay - self._feed) * scale

    def step(self, noise: float) -> float:
        """Output one step later under a standard normal number."""
        a = self._state_a
        self._state_b = b = self._decay * self._state_b + self._feed * a + self._drive_b * noise
        self._state_a = a = self._decay * a + self._drive_a * noise
        return _SQRT3 * a + (1.0 - _SQRT3) * b


class DrydenGusts:
    """Gusts met by a vehicle at changing height and airspeed.

    Every step draws three random numbers, whatever the vehicle does: two controllers on one seed meet the same noise.

    Args:
        w20_m_s: mean wind speed at 20 ft [m/s].
        rng: source of the noise.
        step_s: time between two calls of `step` [s].
    """

    def __init__(self, w20_m_s: float, rng: np.random.Generator, step_s: float) -> None:
        self._w20_m_s = w20_m_s
        self._step_s = step_s
        self._noise = NormalTriples(rng)
        (u, v1, v2), (w1, w2, _) = self._noise.draw(), self._noise.draw()
        self._u = LongitudinalFilter(u)
        self._v = TransverseFilter(v1, v2)
        self._w = TransverseFilter(w1, w2)
        self._height_m = self._speed_m_s = 0.0
        self._sigma_u = self._sigma_v = self._sigma_w = 0.0

    def step(self, height_m: float, airspeed_m_s: float) -> tuple[float, float, float]:
        """Gust (u, v, w) [m/s] one step later, at a height above the ground [m] and an air-relative speed [m/s]."""
        height = min(max(height_m, LOWEST_HEIGHT_M), HIGHEST_HEIGHT_M)
        speed = airspeed_m_s if airspeed_m_s > LOWEST_AIRSPEED_M_S else LOWEST_AIRSPEED_M_S
        if (
            abs(height - self._height_m) > RENEWAL * self._height_m
            or abs(speed - self._speed_m_s) > RENEWAL * self._speed_m_s
        ):
            self._tune(height, speed)
        noise_u, noise_v, noise_w = self._noise.draw()
        return (
            self._sigma_u * self._u.step(noise_u),
            self._sigma_v * self._v.step(noise_v),
            self._sigma_w * self._w.step(noise_w),
        )

    def _tune(self, height_m: float, speed_m_s: float) -> None:
        parameters = low_altitude_parameters(height_m, self._w20_m_s)
        self._height_m, self._speed_m_s = height_m, speed_m_s
        self._sigma_u, self._sigma_v, self._sigma_w = (
            parameters.sigma_u_m_s,
            parameters.sigma_v_m_s,
            parameters.sigma_w_m_s,
        )
        self._u.tune(parameters.length_u_m / speed_m_s, self._step_s)
        self._v.tune(parameters.length_v_m / speed_m_s, self._step_s)
        self._w.tune(parameters.length_w_m / speed_m_s, self._step_s)
