"""The monitors: a breach of geofence or altitude counts when it lasts, and a number that is none is a breach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.flight.monitors import BREACH_TIME_S, MARGIN_M, Monitors
from uasfly.messages import StateEstimate
from uasfly.mission import Geofence, MissionLimits

ZERO = np.zeros(3)
ORIGIN = np.array([10.0, -20.0, 3.0])
LIMITS = MissionLimits(geofence=Geofence(radius_m=5.0, center_m=(1.0, 0.0)), altitude_min_m=0.5, altitude_max_m=4.0)


def _at(x: float, y: float, z: float) -> StateEstimate:
    """An estimate at a place given from the mission's origin."""
    position = ORIGIN + np.array([x, y, z])
    return StateEstimate(0.0, position, ZERO, np.array([1.0, 0.0, 0.0, 0.0]), ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)


def _verdict(monitors: Monitors, estimate: StateEstimate) -> str:
    """What a breach that lasts leads to."""
    assert monitors.check(1.0, estimate, ORIGIN) == ""
    return monitors.check(1.0 + BREACH_TIME_S, estimate, ORIGIN)


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ((1.0, 0.0, 1.5), ""),
        ((6.0 + 0.9 * MARGIN_M, 0.0, 1.5), ""),
        ((6.0 + 1.1 * MARGIN_M, 0.0, 1.5), "outside the geofence: 5.6 m"),
        ((1.0, -5.0 - 1.1 * MARGIN_M, 1.5), "outside the geofence"),
        ((1.0, 0.0, 4.0 + 0.9 * MARGIN_M), ""),
        ((1.0, 0.0, 4.0 + 1.1 * MARGIN_M), "outside the altitude limits: 4.5 m"),
        ((1.0, 0.0, 0.5 - 1.1 * MARGIN_M), "outside the altitude limits"),
        ((math.nan, 0.0, 1.5), "outside the geofence"),
        ((1.0, 0.0, math.nan), "outside the altitude limits"),
    ],
)
def test_a_lasting_breach_beyond_the_margin_is_told(place: tuple[float, float, float], told: str) -> None:
    """Distances count from the fence's centre and heights from the mission's origin."""
    verdict = _verdict(Monitors(LIMITS), _at(*place))
    assert verdict.startswith(told)
    assert bool(verdict) is bool(told)


def test_a_breach_that_ends_in_time_is_forgiven() -> None:
    """A gust over the fence and back starts the count anew."""
    monitors = Monitors(LIMITS)
    outside, inside = _at(9.0, 0.0, 1.5), _at(1.0, 0.0, 1.5)
    assert monitors.check(0.0, outside, ORIGIN) == ""
    assert monitors.check(0.4, outside, ORIGIN) == ""
    assert monitors.check(0.45, inside, ORIGIN) == ""
    assert monitors.check(0.6, outside, ORIGIN) == ""
    assert monitors.check(1.0, outside, ORIGIN) == ""
    assert monitors.check(1.1 + 1e-9, outside, ORIGIN) != ""


def test_without_a_fence_only_the_altitude_counts() -> None:
    """A mission without a geofence may go anywhere between its altitudes."""
    assert _verdict(Monitors(MissionLimits(altitude_max_m=4.0)), _at(5000.0, 0.0, 1.5)) == ""
    assert "altitude" in _verdict(Monitors(MissionLimits(altitude_max_m=4.0)), _at(5000.0, 0.0, 5.0))
