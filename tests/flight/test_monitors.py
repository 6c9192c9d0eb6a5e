"""The monitors look ten times a second, and know of every step nevertheless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.observer.airframes import f550
from uasfly.control.protocol import ControlResult
from uasfly.flight.monitors import Monitors, Watched
from uasfly.flight.view import VehicleView
from uasfly.messages import Action, Authority, Setpoint, StateEstimate
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis

PERIOD_S = 0.02
ZERO = np.zeros(3)
HOVER = Mission.model_validate(
    {
        "name": "hover",
        "takeoff": {"height_m": 2.0},
        "legs": [{"type": "hover", "position_m": [0.0, 0.0, 2.0], "duration_s": 9.0}],
    }
)
CALM = Authority(0.0, 0.0, 0.0, 0.0)


def _watched(time_s: float, height_m: float = 2.0) -> Watched:
    position = np.array((0.0, 0.0, height_m))
    level = np.array((1.0, 0.0, 0.0, 0.0))
    estimate = StateEstimate(time_s, position, ZERO, level, ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)
    diagnosis = Diagnosis(ZERO, ZERO, {}, {}, 0.0, 0.0, 0.0, True, 0.0, 0)
    return Watched(time_s, True, estimate, diagnosis, VehicleView(), ZERO, ZERO, position, CALM)


def _flown(time_s: float, fallback: str) -> ControlResult:
    return ControlResult(Setpoint(time_s, 0.0, 0.0, 0.0, 0.0, 0.5), fallback, 0.0, 0, None, "")


@pytest.mark.parametrize(("rate_hz", "looks"), [(5.0, 10), (50.0, 20), (250.0, 20)])
def test_they_look_ten_times_a_second(rate_hz: float, looks: int) -> None:
    """However fast the cycles are; in slower ones each time."""
    monitors, count = Monitors(HOVER, f550()), 0
    for cycle in range(round(2.0 * rate_hz)):
        if monitors.due(cycle / rate_hz, None):
            monitors.look(_watched(cycle / rate_hz))
            count += 1
    assert count == looks


def test_a_finding_counts_once_it_has_lasted() -> None:
    """Above the highest altitude: half a second, and at most the time between two looks."""
    monitors, time_s = Monitors(HOVER, f550()), 0.0
    while not monitors.alarms and time_s < 2.0:
        time_s += PERIOD_S
        if monitors.due(time_s, None):
            monitors.look(_watched(time_s, height_m=HOVER.limits.altitude_max_m + 1.0))
    assert 0.5 <= time_s <= 0.7
    assert [(alarm.monitor, alarm.action) for alarm in monitors.alarms] == [("altitude", Action.END)]


def test_a_vehicle_that_stands_on_its_way_lands() -> None:
    """Where it believes to be 2 m high something carries it: the next look ends the mission by landing."""
    monitors, time_s = Monitors(HOVER, f550()), 0.0
    while not monitors.alarms and time_s < 2.0:
        time_s += PERIOD_S
        if monitors.due(time_s, None):
            monitors.look(replace(_watched(time_s), carried=time_s > 0.5))
    assert 0.5 < time_s <= 0.62
    assert [(alarm.monitor, alarm.action) for alarm in monitors.alarms] == [("contact", Action.LAND)]
    assert "2.0 m high" in monitors.alarms[0].text


def test_steps_between_looks_are_counted() -> None:
    """Four of five steps by the backup, the fifth, which is the one looked at, by the solver: the mission ends."""
    monitors = Monitors(HOVER, f550())
    for cycle in range(100):
        time_s = cycle * PERIOD_S
        if monitors.due(time_s, _flown(time_s, "" if cycle % 5 == 0 else "backup")):
            monitors.look(_watched(time_s))
    assert {(alarm.monitor, alarm.action) for alarm in monitors.alarms} == {
        ("solver", Action.WARN),
        ("solver", Action.END),
    }
