"""A wind or a disturbance split by frequency: quasi-static, gusts, and the rest.

The band of gusts, 0.005 to 0.1389 Hz (periods of 7.2 to 200 s), is that of Asignacion et al. 2022. Slower changes are
the mean wind's; faster ones turbulence, vibration and noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from uasfly.errors import UasflyError
from uasfly.messages import Array

GUST_BAND_HZ = (0.005, 0.1389)
_ORDER = 2
_LONGEST_GAP_S = 10.0


@dataclass(frozen=True, slots=True)
class Bands:
    """One sample's parts, each of the sample's shape and unit; their sum is the sample.

    Attributes:
        quasi_static: below the band. gust: inside it. rest: above it.
    """

    quasi_static: Array
    gust: Array
    rest: Array


class BandSplit:
    """Causal split of a signal that comes sample by sample, by two Butterworth filters of second order.

    What a low pass lets through is quasi-static, what a high pass lets through is the rest, and gust is what is left:
    nothing gets lost. In the middle of the band (0.026 Hz) gust is in phase with the signal and 7 % too large; a second
    low pass instead of the high pass would make it 15 degrees late, and what it lacks would show as rest.

    Args:
        period_s: time between two samples [s].
        band_hz: where the gusts begin and end [Hz].
    """

    def __init__(self, period_s: float, band_hz: tuple[float, float] = GUST_BAND_HZ) -> None:
        low, high = band_hz
        if not 0.0 < low < high < math.inf:
            raise UasflyError(f"band_hz: expected two frequencies, the lower one first, found {low}, {high}")
        if not 0.0 < period_s < 0.5 / high:
            raise UasflyError(
                f"period_s: expected more than two samples a period of {high} Hz (less than {0.5 / high:.3g} s), "
                f"found {period_s}"
            )
        self._period_s = period_s
        kinds = ((low, "lowpass"), (high, "highpass"))
        self._filters = [butter(_ORDER, edge, kind, fs=1.0 / period_s, output="sos") for edge, kind in kinds]
        self._states: list[Array] = []
        self._passed: list[Array] = []
        self._time_s = -math.inf
        self._value: Array = np.zeros(0)

    def update(self, time_s: float, value: Array) -> Bands:
        """Take in a sample of shape (n,) and give its parts.

        The first sample, and the first after a gap of more than 10 s, counts as if the signal had always been that:
        all of it is quasi-static. Over lost samples the signal is taken as linear. A sample that comes too early, or is
        not finite, does not move the filters.
        """
        gap_s = time_s - self._time_s
        value = np.array(value, dtype=float)
        if not (math.isfinite(time_s) and np.isfinite(value).all()):
            return self._parts(value)
        if gap_s > _LONGEST_GAP_S:
            self._time_s = time_s
            self._states = [sosfilt_zi(sos)[:, :, None] * value for sos in self._filters]
            self._passed = [value, np.zeros_like(value)]
        else:
            count = max(0, round(gap_s / self._period_s))
            if count == 0:
                return self._parts(value)
            way = np.linspace(self._value, value, count + 1)[1:]
            for number, sos in enumerate(self._filters):
                passed, self._states[number] = sosfilt(sos, way, axis=0, zi=self._states[number])
                self._passed[number] = passed[-1]
            self._time_s += count * self._period_s  # whole periods: uneven samples keep the filters' rate
        self._value = value
        return self._parts(value)

    def _parts(self, value: Array) -> Bands:
        quasi_static, rest = self._passed or (value, value)
        return Bands(quasi_static, value - quasi_static - rest, rest)
