"""Answers to the link's TIMESYNC requests."""

from __future__ import annotations

import math

import pytest

from uasfly.link.clock import ClockMap
from uasfly.link.timesync import TimeSync


@pytest.mark.parametrize("wrong", [10**400, -(10**30), 1e300, 2**63, math.inf])
def test_a_time_that_64_bits_do_not_hold_leaves_the_clock_alone(wrong: float) -> None:
    """One such answer would make every later time NaN, and no setpoint could be sent any more."""
    clock = ClockMap()
    exchange = TimeSync(clock)
    for second in range(3):
        exchange.request(1, second * 10**9)
        exchange.receive({"tc1": (second + 500) * 10**9, "ts1": second * 10**9}, second + 0.001)
    exchange.request(1, 3 * 10**9)
    with pytest.raises(ValueError, match="64 bits"):
        exchange.receive({"tc1": wrong, "ts1": 3 * 10**9}, 3.001)
    assert clock.to_vehicle(4.0) == pytest.approx(504.0, abs=0.01)
