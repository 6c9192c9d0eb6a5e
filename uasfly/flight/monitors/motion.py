"""Is the vehicle where it may be, where it should be, in the air, and upright?"""

from __future__ import annotations

import math

from uasfly.airframe import Airframe
from uasfly.flight.monitors.watched import Watched
from uasfly.mission import MissionLimits
from uasfly.monitor_settings import FenceMonitor, TiltMonitor, TrackingMonitor


class OutsideFence:
    """Beyond the geofence; a position that is no number is outside too."""

    def __init__(self, limits: MissionLimits, settings: FenceMonitor) -> None:
        """Take the fence and the margin."""
        self._fence = limits.geofence
        self._margin_m = settings.margin_m

    def __call__(self, watched: Watched) -> str:
        """How far from its centre."""
        fence = self._fence
        if fence is None:
            return ""
        x, y, _ = (watched.estimate.position_in_world - watched.origin).tolist()
        distance = math.hypot(x - fence.center_m[0], y - fence.center_m[1])
        if distance <= fence.radius_m + self._margin_m:
            return ""
        return f"outside the geofence: {distance:.1f} m from its centre"


class OutsideAltitudes:
    """Above or below the mission's heights."""

    def __init__(self, limits: MissionLimits, settings: FenceMonitor) -> None:
        """Take the limits and the margin."""
        self._low = limits.altitude_min_m - settings.margin_m
        self._high = limits.altitude_max_m + settings.margin_m

    def __call__(self, watched: Watched) -> str:
        """At which height."""
        z = float(watched.estimate.position_in_world[2] - watched.origin[2])
        return "" if self._low <= z <= self._high else f"outside the altitude limits: {z:.1f} m"


class FarFromReference:
    """The tracking error."""

    def __init__(self, settings: TrackingMonitor) -> None:
        """Take the threshold."""
        self._error_m = settings.error_m

    def __call__(self, watched: Watched) -> str:
        """How far."""
        if watched.reference is None:
            return ""
        error = math.dist(watched.estimate.position_in_world.tolist(), watched.reference.tolist())
        return "" if error <= self._error_m else f"{error:.1f} m away from where it should be"


def carried(watched: Watched) -> str:
    """Where the vehicle believes to be while something carries it."""
    if not watched.carried:
        return ""
    height_m = float(watched.estimate.position_in_world[2] - watched.origin[2])
    return f"it stands on something, {height_m:.1f} m high by the estimate"


class Tilted:
    """Beyond what the vehicle is ever asked to."""

    def __init__(self, airframe: Airframe, settings: TiltMonitor) -> None:
        """Take the limit; roll and pitch at their limits tilt by more than each of them."""
        both = math.acos(math.cos(airframe.limits.tilt_rad) ** 2)
        self._limit_rad = both + math.radians(settings.excess_deg)

    def __call__(self, watched: Watched) -> str:
        """How much."""
        _, x, y, _ = watched.estimate.quaternion_body_to_world.tolist()
        tilt = math.acos(min(1.0, max(-1.0, 1.0 - 2.0 * (x * x + y * y))))
        return "" if tilt <= self._limit_rad else f"tilted by {math.degrees(tilt):.0f} deg"
