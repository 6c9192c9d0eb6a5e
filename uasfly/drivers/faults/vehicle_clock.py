"""The vehicle's clock as it is heard on the wire: the least delay of the last half second."""

from __future__ import annotations

import math
from collections import deque

# A simulated vehicle that was held up has lost that time for good: longer, and its program, which has noticed, would
# seem to be late.
WINDOW_S = 0.5
STEP_S = 0.5  # the clock has been moved by more than this: it was restarted or jumped


class VehicleClock:
    """Host time of the vehicle's times.

    Attributes:
        offset_s: host time minus vehicle time, NaN before the first message.
    """

    def __init__(self) -> None:
        self.offset_s = math.nan
        self._heard: deque[tuple[float, float]] = deque()

    def hear(self, now_s: float, vehicle_s: float) -> None:
        """A message that was sent at a time of the vehicle's clock has come at a host time."""
        offset_s, heard = now_s - vehicle_s, self._heard
        if not abs(offset_s - self.offset_s) < STEP_S:
            heard.clear()
        heard.append((now_s, offset_s))
        while heard[0][0] < now_s - WINDOW_S:
            heard.popleft()
        self.offset_s = min(offset for _, offset in heard)
