"""Is the vehicle ready to fly, as far as its telemetry tells?"""

from __future__ import annotations

from uasfly.flight.view import VehicleView
from uasfly.messages import StateEstimate

VELOCITY_SIGMA_READY_M_S = 0.2
POSITION_SIGMA_READY_M = 10.0  # GNSS drifts unseen while the vehicle waits on the ground, so this one cannot be tight


def unready(view: VehicleView, estimate: StateEstimate | None) -> str:
    """Why it is not, for the pilot; "" when it is."""
    if view.health is not None and not (view.health.attitude_ok and view.health.velocity_ok):
        return "PX4's estimator reports no attitude or velocity"
    if estimate is None:
        return "no estimate"
    velocity, position = float(estimate.velocity_sigma_m_s.max()), float(estimate.position_sigma_m.max())
    if velocity < VELOCITY_SIGMA_READY_M_S and position < POSITION_SIGMA_READY_M:
        return ""
    return f"velocity is known to {velocity:.2f} m/s, position to {position:.2f} m"
