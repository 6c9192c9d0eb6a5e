"""Drag against airspeed, and back: linear from the rotors, quadratic from the body.

Rotors in forward flight push back in proportion to the airspeed times their speed (flapping and induced drag: Martin &
Salaun 2010, *The true role of accelerometer feedback in quadrotor control*, eq. 2), so with the square root of thrust;
frame and battery with the square of the airspeed (bluff bodies).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.airframe import GRAVITY_M_S2, Airframe, WindSettings

UNKNOWN_DRAG_SHARE = 0.3  # of a drag that was not identified: the linear one of the model, which is right at one speed
UNKNOWN_TILT_RAD = 0.005
LEAST_THRUST_M_S2 = 1.0  # in free fall the rotors turn too


@dataclass(frozen=True, slots=True)
class DragCurve:
    """Mass-normalised drag (drag_1_s + drag_1_m * s) * u [m/s^2] at an airspeed of size s and a component u of it.

    Attributes:
        drag_1_s: linear part, positive, where the thrust carries the weight. drag_1_m: quadratic part, not negative.
    """

    drag_1_s: float
    drag_1_m: float

    def force(self, airspeed_m_s: float) -> float:
        """Drag [m/s^2] at an airspeed [m/s], 0 or more."""
        return (self.drag_1_s + self.drag_1_m * airspeed_m_s) * airspeed_m_s

    def slope(self, airspeed_m_s: float) -> float:
        """Derivative of `force` [1/s]: what a change along the airspeed does. It is never below drag_1_s."""
        return self.drag_1_s + 2.0 * self.drag_1_m * airspeed_m_s

    def ratio(self, airspeed_m_s: float) -> float:
        """Force over airspeed [1/s]: what a change across the airspeed does."""
        return self.drag_1_s + self.drag_1_m * airspeed_m_s

    def under_thrust(self, thrust_m_s2: float) -> DragCurve:
        """The curve where the thrust is `thrust_m_s2` instead of the weight: the rotors turn at another speed."""
        return DragCurve(self.drag_1_s * math.sqrt(max(thrust_m_s2, LEAST_THRUST_M_S2) / GRAVITY_M_S2), self.drag_1_m)

    def airspeed(self, force_m_s2: float) -> float:
        """Airspeed [m/s] that gives a drag [m/s^2], 0 or more: the inverse of `force`, without cancellation."""
        root = math.sqrt(self.drag_1_s * self.drag_1_s + 4.0 * self.drag_1_m * force_m_s2)
        return 2.0 * force_m_s2 / (self.drag_1_s + root)


def wind_settings(airframe: Airframe) -> WindSettings | None:
    """The airframe's identified drag, or the linear drag of its model with a large sigma; None where that is zero."""
    if airframe.wind is not None:
        return airframe.wind
    x, y, _ = airframe.model.drag_1_s
    linear = 0.5 * (x + y)
    if linear < 1e-3:  # a vehicle that feels no wind measures none
        return None
    return WindSettings(
        drag_1_s=linear, drag_1_m=0.0, drag_sigma_share=UNKNOWN_DRAG_SHARE, tilt_sigma_rad=UNKNOWN_TILT_RAD
    )
