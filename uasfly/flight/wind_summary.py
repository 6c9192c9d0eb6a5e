"""The wind of a whole flight for its summary: mean and gusts over the legs, and against truth where there is one."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from uasfly.messages import Status, TruthSample
from uasfly.wind_messages import WindEstimate

KEPT = 64  # truth samples: more than a second, the wind is told 0.3 s late
NEAR_S = 0.1  # between two truth samples; further apart they say nothing of the wind between them


@dataclass(slots=True)
class WindSummary:
    """Collects the wind, five times a second, while the legs fly."""

    _last: WindEstimate | None = None
    _count: int = 0
    _east: float = 0.0
    _north: float = 0.0
    _gust_m_s: float = 0.0
    _margin: float = math.inf
    _compared: int = 0
    _squares: float = 0.0
    _truths: deque[TruthSample] = field(default_factory=lambda: deque(maxlen=KEPT))

    def hear(self, truth: TruthSample) -> None:
        """The true wind."""
        self._truths.append(truth)

    def cycle(self, status: Status) -> None:
        """One step of the legs."""
        wind = status.wind
        if wind is None or wind is self._last:
            return
        self._last = wind
        east, north = wind.velocity_in_world.tolist()
        self._count += 1
        self._east += east
        self._north += north
        self._gust_m_s = max(self._gust_m_s, wind.gust_m_s)
        self._margin = min(self._margin, wind.margin)
        true = self._true_at(wind.time_s)
        if true is not None:
            self._compared += 1
            self._squares += (east - true[0]) ** 2 + (north - true[1]) ** 2

    def _true_at(self, time_s: float) -> tuple[float, float] | None:
        """The true wind, between two samples of it; None where there are none around."""
        after = bisect_right(self._truths, time_s, key=lambda truth: truth.time_s)
        if not 0 < after < len(self._truths):
            return None
        first, second = self._truths[after - 1], self._truths[after]
        interval_s = second.time_s - first.time_s
        if not 0.0 < interval_s < NEAR_S:
            return None
        share = (time_s - first.time_s) / interval_s
        east, north, _ = (first.wind_in_world + share * (second.wind_in_world - first.wind_in_world)).tolist()
        return east, north

    def result(self) -> dict[str, Any] | None:
        """Plain data; None where the wind was never known in the legs."""
        wind = self._last
        if wind is None:
            return None
        east, north = self._east / self._count, self._north / self._count
        speed = math.hypot(east, north)
        known = speed > wind.mean_speed_sigma_m_s
        return {
            "mean_m_s": round(speed, 3),
            "from_deg": round(math.degrees(math.atan2(-east, -north)) % 360.0, 1) if known else None,
            "sigma_m_s": round(wind.mean_speed_sigma_m_s, 3),
            "gust_m_s": round(self._gust_m_s, 3),
            "margin": round(self._margin, 3),
            "holdable_m_s": round(wind.holdable_m_s, 2),
            "error_rms_m_s": round(math.sqrt(self._squares / self._compared), 3) if self._compared else None,
        }
