"""Is the estimate good enough to fly by, next to a structure?"""

from __future__ import annotations

import math

from uasfly.flight.monitors.watched import Watched
from uasfly.monitor_settings import EstimateMonitor


class UncertainEstimate:
    """The estimate is uncertain, or its sensors contradict each other."""

    def __init__(self, settings: EstimateMonitor) -> None:
        """Take the thresholds."""
        self._settings = settings

    def __call__(self, watched: Watched) -> str:
        """What is wrong with it."""
        settings, diagnosis = self._settings, watched.diagnosis
        position, velocity = max(diagnosis.position_sigma_m.tolist()), max(diagnosis.velocity_sigma_m_s.tolist())
        if not position <= settings.position_sigma_m:
            return f"position known to {position:.2f} m only"
        if not velocity <= settings.velocity_sigma_m_s:
            return f"velocity known to {velocity:.2f} m/s only"
        # A position that is refused is an error of GNSS and has its own monitors. A velocity that is refused although
        # the position agrees with it is a gust that pushes harder than the model can explain.
        shares = diagnosis.rejected_share
        for sensor in ("velocity", "attitude"):
            share = shares.get(sensor, 0.0)
            if share > settings.rejected_share and not (sensor == "velocity" and diagnosis.agrees):
                return f"{share * 100.0:.0f} % of PX4's {sensor} contradicts the estimate"
        return ""


def not_finite(watched: Watched) -> str:
    """Numbers that are none."""
    estimate = watched.estimate
    total = (
        sum(estimate.position_in_world.tolist())
        + sum(estimate.velocity_in_world.tolist())
        + sum(estimate.quaternion_body_to_world.tolist())
        + sum(estimate.force_in_world.tolist())
    )
    return "" if math.isfinite(total) else "the estimate is not finite"
