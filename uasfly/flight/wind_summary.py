"""The wind of a whole flight for its summary: mean and gusts over the legs, and against truth where there is one."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from uasfly.messages import Status, TruthSample
from uasfly.wind_messages import WindEstimate

KEPT = 64  # truth samples: more than a second, the wind is told 0.3 s late
NEAR_S = 0.05  # truth further away from the wind's own time says nothing


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
        near = min(self._truths, key=lambda truth: abs(truth.time_s - wind.time_s), default=None)
        if near is not None and abs(near.time_s - wind.time_s) < NEAR_S:
            true_east, true_north, _ = near.wind_in_world.tolist()
            self._compared += 1
            self._squares += (east - true_east) ** 2 + (north - true_north) ** 2

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
