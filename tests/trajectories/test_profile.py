"""Jerk-limited changes of velocity keep their limits and fit distance or duration."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from uasfly.trajectories.profile import (
    MotionLimits,
    move_duration,
    peak_speed,
    ramp_duration,
    ramp_phases,
    speed_for_duration,
)

limits = st.builds(MotionLimits, st.floats(0.05, 20.0), st.floats(0.05, 100.0))
distances = st.floats(1e-3, 1e3)


@given(st.floats(1e-3, 50.0), limits)
def test_a_ramp_changes_the_velocity_by_what_was_asked_within_its_limits(delta: float, limit: MotionLimits) -> None:
    """Growing and falling at the jerk, constant in between: the area under the acceleration is the change."""
    growing, constant = ramp_phases(delta, limit)
    assert limit.jerk * growing * (growing + constant) == pytest.approx(delta)
    assert limit.jerk * growing <= limit.acceleration * (1.0 + 1e-12)
    assert constant >= 0.0
    assert ramp_duration(delta, limit) == 2.0 * growing + constant


@given(distances, limits)
def test_at_its_peak_speed_a_move_has_no_cruise(distance: float, limit: MotionLimits) -> None:
    """Both ramps together cover the distance exactly."""
    speed = peak_speed(distance, limit)
    assert speed * ramp_duration(speed, limit) == pytest.approx(distance)


@given(distances, st.floats(1e-2, 50.0), limits)
def test_no_faster_move_exists(distance: float, speed: float, limit: MotionLimits) -> None:
    """Any slower cruise takes longer; the speed limit is kept by asking for no more."""
    shortest = move_duration(distance, speed, limit)
    cruise = min(speed, peak_speed(distance, limit))
    assert shortest >= distance / cruise
    for share in (0.3, 0.9):
        assert move_duration(distance, share * cruise, limit) > shortest


@given(distances, limits, st.floats(1.0, 50.0))
def test_a_duration_is_met_exactly(distance: float, limit: MotionLimits, factor: float) -> None:
    """Whatever is longer than the fastest move is hit to rounding."""
    duration = factor * move_duration(distance, math.inf, limit)
    speed = speed_for_duration(distance, duration, limit)
    assert speed is not None
    assert move_duration(distance, speed, limit) == pytest.approx(duration, rel=1e-9)


@given(distances, limits)
def test_a_duration_that_is_too_short_has_no_speed(distance: float, limit: MotionLimits) -> None:
    """Shorter than the fastest move cannot be."""
    assert speed_for_duration(distance, 0.99 * move_duration(distance, math.inf, limit), limit) is None


def test_no_distance_takes_no_time() -> None:
    """A move to where one is."""
    assert move_duration(0.0, 1.0, MotionLimits(1.0, 1.0)) == 0.0


def test_a_known_case() -> None:
    """10 m at 2 m/s with 1 m/s^2 and 2 m/s^3: 5 s of way and a ramp of 2.5 s."""
    assert move_duration(10.0, 2.0, MotionLimits(1.0, 2.0)) == pytest.approx(7.5)
