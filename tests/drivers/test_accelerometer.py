"""Flights with the accelerometer, without it, and with one that fails."""

from __future__ import annotations

from typing import Any

import pytest

from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse

SHORT = "mission.legs[0].duration_s=12"
UNUSED = "airframe.observer.accelerometer_sigma_m_s2=null"


def flown(*settings: str) -> dict[str, Any]:
    """Summary of a short hover in gusts."""
    return rehearse(load_plan("hover", "f550", scenario="gusty", seed=1, settings=[SHORT, *settings]))


@pytest.fixture(scope="module")
def without() -> dict[str, Any]:
    """The flight of a vehicle whose accelerometer is not used."""
    return flown(UNUSED)


def failing(says: str, after: str, at_s: float) -> str:
    """A setting that lets the accelerometer fail."""
    return f"scenario.faults=[{{kind: accelerometer, says: {says}, after: {after}, at_s: {at_s}}}]"


def test_the_accelerometer_holds_the_vehicle_closer(without: dict[str, Any]) -> None:
    """In gusts, with a healthy vehicle's vibration: at least a tenth less error."""
    with_it = flown()
    assert with_it["outcome"] == "completed"
    assert with_it["tracking_rms_m"]["total"] < 0.9 * without["tracking_rms_m"]["total"]


def test_a_silent_one_changes_nothing() -> None:
    """The same flight as without one (on a link that gives each message the same delay)."""
    steady = "scenario.link.jitter_s=0"
    silent, unused = flown(failing("nothing", "boot", 0.0), steady), flown(UNUSED, steady)
    assert silent["tracking_rms_m"] == unused["tracking_rms_m"]
    assert silent["force_m_s2"] == unused["force_m_s2"]


@pytest.mark.parametrize("says", ["nothing", "nan", "huge"])
def test_one_that_fails_in_flight_is_flown_without(says: str, without: dict[str, Any]) -> None:
    """It stops, or says garbage, four seconds into the mission: no worse than without it, and nobody is alarmed."""
    summary = flown(failing(says, "offboard", 4.0))
    assert summary["outcome"] == "completed"
    assert summary["tracking_rms_m"]["total"] < 1.02 * without["tracking_rms_m"]["total"]
    assert summary["rejected"]["position"] <= without["rejected"]["position"]
    assert summary["warnings"] == without["warnings"]


def test_a_badly_shaken_one_does_no_harm(without: dict[str, Any]) -> None:
    """Vibration of 3 m/s^2, as on the worst of the flight logs: the filter finds out, and flies as without."""
    summary = flown("scenario.sensors.vibration_m_s2=3.0")
    assert summary["outcome"] == "completed"
    assert summary["tracking_rms_m"]["total"] < 1.02 * without["tracking_rms_m"]["total"]
