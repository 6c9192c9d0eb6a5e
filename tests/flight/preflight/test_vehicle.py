"""Health, estimate, GNSS and battery, each way."""

from __future__ import annotations

import math
from typing import Any

import pytest

from tests.flight.preflight.gathering import (
    OK,
    STOP,
    WARNING,
    check,
    diagnosis,
    estimate,
    mission,
    verdict,
    view,
)
from uasfly.flight.view import VehicleView
from uasfly.messages import BatterySample
from uasfly.preflight_messages import Verdict


@pytest.mark.parametrize("flag", ["attitude", "velocity", "position"])
def test_a_vehicle_that_is_not_healthy_is_not_flown(flag: str) -> None:
    """The line names what is missing; silence is a warning."""
    changes: dict[str, Any] = {f"{flag}_ok": False}
    line = check("health", view=view(**changes))
    assert (line.verdict, line.value) == (STOP, f"no valid {flag}")
    assert verdict("health") is OK
    assert check("health", view=VehicleView()).value == "not told"
    assert verdict("health", view=VehicleView()) is WARNING


def test_the_estimate_must_have_converged() -> None:
    """The same thresholds as the flight waits for."""
    assert check("estimate").value == "position to 0.02 m, velocity to 0.02 m/s"
    assert verdict("estimate", estimate=estimate(sigma=0.5)) is STOP
    line = check("estimate", estimate=None, diagnosis=None, origin=None)
    assert (line.verdict, line.value) == (STOP, "no estimate")


@pytest.mark.parametrize(
    ("rejected", "nis", "expected"),
    [
        ({"velocity": 0.05}, {}, OK),
        ({"velocity": 0.2}, {}, WARNING),
        ({"velocity": 0.7}, {}, STOP),
        ({"attitude": math.nan}, {"attitude": math.nan}, OK),
        ({}, {"velocity": 2.9}, OK),
        ({}, {"position": 4.0}, WARNING),
    ],
)
def test_measurements_must_agree(rejected: dict[str, float], nis: dict[str, float], expected: Verdict) -> None:
    """Refused measurements count first, then errors larger than the airframe file says."""
    assert verdict("consistency", diagnosis=diagnosis(rejected, nis)) is expected


def test_nothing_measured_is_not_consistent() -> None:
    """A warning that says so."""
    assert verdict("consistency", diagnosis=None) is WARNING


@pytest.mark.parametrize(
    ("changes", "expected", "told"),
    [
        ({}, OK, "12 satellites, accurate to 0.5 m"),
        ({"gnss_fix": 1}, WARNING, "no fix"),
        ({"gnss_fix": 1, "position_ok": False}, STOP, "no fix"),
        ({"horizontal_accuracy_m": 3.5}, WARNING, "accurate to 3.5 m"),
        ({"horizontal_accuracy_m": math.nan}, OK, "accuracy not told"),
        ({"gnss_satellites": 5}, WARNING, "5 satellites"),
        ({"gnss_satellites": 0}, OK, "satellites not told"),
    ],
)
def test_gnss_has_its_quality(changes: dict[str, Any], expected: Verdict, told: str) -> None:
    """Without a fix it matters whether PX4 has its position from elsewhere; 0 satellites means not told."""
    line = check("gnss", view=view(**changes))
    assert line.verdict is expected
    assert told in line.value


def test_gnss_of_which_nothing_is_heard() -> None:
    """A warning."""
    assert verdict("gnss", view=VehicleView()) is WARNING


@pytest.mark.parametrize(
    ("voltage_v", "remaining", "expected", "told"),
    [
        (16.4, 0.9, OK, "90 %, 16.4 V"),
        (15.0, 0.25, WARNING, "25 %, 15.0 V"),
        (14.0, 0.15, STOP, "15 %, 14.0 V"),
        (16.4, math.nan, WARNING, "charge not told, 16.4 V"),
        (math.nan, 0.9, OK, "90 %"),
        (math.nan, math.nan, WARNING, "not told"),
    ],
)
def test_the_battery_is_charged(voltage_v: float, remaining: float, expected: Verdict, told: str) -> None:
    """Against the thresholds of the mission's own monitor."""
    line = check("battery", view=view(battery=BatterySample(100.0, voltage_v, remaining)))
    assert (line.verdict, line.value) == (expected, told)


def test_the_voltage_counts_where_the_mission_names_one() -> None:
    """Below it the mission would end at once."""
    strict = mission(monitors={"battery": {"voltage_v": 15.0}})
    assert verdict("battery", mission=strict, view=view(battery=BatterySample(100.0, 14.9, 0.9))) is STOP
    assert verdict("battery", mission=strict, view=view(battery=BatterySample(100.0, 15.1, 0.9))) is OK
    assert verdict("battery", view=view(battery=None)) is WARNING


@pytest.mark.parametrize(
    ("minutes", "remaining", "expected"),
    [(3.0, 0.9, OK), (3.0, 0.5, WARNING), (12.0, 0.9, WARNING), (12.0, 0.4, STOP), (0.5, 0.1, STOP)],
)
def test_the_charge_lasts_for_the_mission(minutes: float, remaining: float, expected: Verdict) -> None:
    """Told as what a full battery has to fly, because what the vehicle uses is not known on the ground."""
    hover = {"type": "hover", "position_m": [2.0, 0.0, 1.5], "duration_s": 60.0 * minutes}
    battery = BatterySample(100.0, 16.0, remaining)
    line = check("endurance", mission=mission(legs=[hover]), view=view(battery=battery))
    assert line.verdict is expected
    if remaining > 0.2:
        assert "consumption is not known" in line.value


def test_endurance_is_a_plain_division() -> None:
    """70 % above the threshold for 60 s of hover, 6 s of way to it, take-off and landing; less in the air."""
    ground, air = check("endurance"), check("endurance", view=view(in_air=True))
    assert ground.value.startswith("1.4 min of flight: enough where a full battery flies 2.0 min")
    assert air.value.startswith("1.3 min of flight")
    unknown = check("endurance", view=view(battery=BatterySample(100.0, 16.0, math.nan)))
    assert (unknown.verdict, "charge not told" in unknown.value) == (WARNING, True)
