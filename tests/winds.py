"""A wind estimate for tests that only pass it on."""

from __future__ import annotations

from typing import Any

import numpy as np

from uasfly.wind_messages import WindEstimate


def wind_estimate(**changes: Any) -> WindEstimate:
    """5.8 m/s from east-north-east, towards (-5, -3)."""
    values: dict[str, Any] = {
        "time_s": 1.0,
        "velocity_in_world": np.array((-6.0, -2.0)),
        "covariance": 0.04 * np.eye(2),
        "mean_in_world": np.array((-5.0, -3.0)),
        "mean_covariance": 0.04 * np.eye(2),
        "averaged_s": 10.0,
        "mean_speed_m_s": 5.83,
        "mean_from_deg": 59.04,
        "mean_speed_sigma_m_s": 0.2,
        "mean_from_sigma_deg": 2.0,
        "gust_m_s": 9.2,
        "variability_m_s": 1.1,
        "holdable_m_s": 12.5,
        "margin": 0.4,
    }
    return WindEstimate(**(values | changes))
