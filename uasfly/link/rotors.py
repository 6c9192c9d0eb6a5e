"""ESC_STATUS as samples of the rotors' speeds: four rotors a message, the messages of one time put together.

Common MAVLink (message 291): `index` is the first of the four, `rpm` signed, `time_usec` the vehicle's. How many rotors
there are it does not say, so the highest index that has come so far ends a sample: the first one may be short.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from uasfly.link.clock import ClockMap
from uasfly.messages import RotorSample

NAME = "ESC_STATUS"
MOST_ROTORS = 16
_BATCH = 4
_MICRO = 1e-6
_RAD_S_PER_RPM = 2.0 * math.pi / 60.0


class RotorAssembler:
    """Puts the messages of one time together.

    Args:
        clock: maps the vehicle's time stamps to host time.
    """

    def __init__(self, clock: ClockMap) -> None:
        self._clock = clock
        self._time_us: int | None = None
        self._speeds: list[float] = []
        self._last_index = 0

    def add(self, fields: dict[str, Any], arrival_s: float) -> RotorSample | None:
        """One message; the sample that it completes, else None. What misses its beginning is left out.

        Raises:
            LookupError, TypeError, ValueError: a field is missing, or is none of the message's.
        """
        index, time_us = fields["index"], fields["time_usec"]
        speeds = [_RAD_S_PER_RPM * rpm for rpm in fields["rpm"]]
        if len(speeds) != _BATCH or index not in range(0, MOST_ROTORS, _BATCH):
            raise ValueError(f"expected {_BATCH} rotors from 0, 4, .. on, found {len(speeds)} from {index} on")
        if not math.isfinite(sum(speeds)):
            raise ValueError(f"expected finite speeds, found {speeds}")
        if index == 0:
            self._time_us, self._speeds = time_us, []
        if time_us != self._time_us or len(self._speeds) != index:
            self._time_us = None
            return None
        self._speeds += speeds
        self._last_index = max(self._last_index, index)
        if index < self._last_index:
            return None
        return RotorSample(self._clock.to_host(time_us * _MICRO, arrival_s), np.array(self._speeds))
