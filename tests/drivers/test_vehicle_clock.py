"""The vehicle's clock as the fault table hears it."""

from __future__ import annotations

import math

import pytest

from uasfly.drivers.faults.vehicle_clock import VehicleClock


def heard(clock: VehicleClock, from_s: float, to_s: float, offset_s: float, delay_s: float = 0.003) -> None:
    """Messages at 50 Hz; every second one comes `delay_s` late, the others at once."""
    for step in range(round((to_s - from_s) / 0.02)):
        now_s = from_s + 0.02 * step
        clock.hear(now_s, now_s - offset_s - (delay_s if step % 2 else 0.0))


def test_the_least_delay_counts() -> None:
    """Messages that come late do not move it."""
    clock = VehicleClock()
    assert math.isnan(clock.offset_s)
    heard(clock, 0.0, 3.0, offset_s=-40.0)
    assert clock.offset_s == pytest.approx(-40.0, abs=1e-9)


@pytest.mark.parametrize("lost_s", [0.25, 0.45, 0.6, 100.0])
def test_time_that_the_vehicle_has_lost_is_followed_within_half_a_second(lost_s: float) -> None:
    """Held up in its own process it stays behind, by as much as a stale setpoint may be old."""
    clock = VehicleClock()
    heard(clock, 0.0, 2.0, offset_s=5.0)
    heard(clock, 2.0 + lost_s, 2.0 + lost_s + 0.56, offset_s=5.0 + lost_s)
    assert clock.offset_s == pytest.approx(5.0 + lost_s, abs=1e-9)


def test_a_clock_that_jumps_ahead_is_followed_at_once() -> None:
    """It cannot be a delay."""
    clock = VehicleClock()
    heard(clock, 0.0, 2.0, offset_s=5.0)
    clock.hear(2.0, 2.0 - 4.9)
    assert clock.offset_s == pytest.approx(4.9, abs=1e-9)
