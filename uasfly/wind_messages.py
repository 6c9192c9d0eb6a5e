"""The wind as a flight tells it: live, in the log and to the ground station."""

from __future__ import annotations

from uasfly.message_class import Array, message


@message
class WindEstimate:
    """Horizontal wind at the vehicle. Vectors are world ENU, east and north, and point where the air moves to.

    Attributes:
        time_s: when `velocity_in_world` was true; the means end then too.
        velocity_in_world: (2,) m/s. covariance: (2, 2) m^2/s^2 of its error.
        mean_in_world: (2,) m/s, mean over the last `averaged_s`. mean_covariance: (2, 2) m^2/s^2 of its error.
        averaged_s: up to 10 s, less soon after take-off.
        mean_speed_m_s: length of the mean. mean_from_deg: where it comes from, degrees from north, clockwise, as pilots
            say it; NaN where the mean is weaker than its own sigma.
        mean_speed_sigma_m_s, mean_from_sigma_deg: standard deviations of both.
        gust_m_s: strongest mean over 3 s, of the last 10 minutes (the gust of WMO-No. 8).
        variability_m_s: standard deviation of the horizontal wind along one axis, over `averaged_s`.
        holdable_m_s: steady wind that tilt and thrust can hold against.
        margin: share of that force that the gust, or the mean where it is stronger, leaves; negative beyond it.
    """

    time_s: float
    velocity_in_world: Array
    covariance: Array
    mean_in_world: Array
    mean_covariance: Array
    averaged_s: float
    mean_speed_m_s: float
    mean_from_deg: float
    mean_speed_sigma_m_s: float
    mean_from_sigma_deg: float
    gust_m_s: float
    variability_m_s: float
    holdable_m_s: float
    margin: float
