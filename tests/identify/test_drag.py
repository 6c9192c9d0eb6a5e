"""The drag out of flights in calm air."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.wind.steady_air import estimates
from uasfly.airframe import GRAVITY_M_S2, WindSettings
from uasfly.cli.identify import drag
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.drivers.watching import Cycle
from uasfly.errors import FileError, UasflyError
from uasfly.identify.drag import identify_drag, moments
from uasfly.messages import FlightMode, Phase, StateEstimate, Status, VehicleSample
from uasfly.record.writer import LogWriter
from uasfly.sim.plant import AIR_DENSITY_KG_M3, Plant
from uasfly.wind.drag_curve import DragCurve
from uasfly.yaml_text import parse_yaml

SHORT = [
    "airframe.limits.speed_m_s=10",
    "mission.limits.geofence.radius_m=100",
    "mission.legs=[{type: back_and_forth, start_m: [0, 0, 3], end_m: [25, 0, 3], speed_m_s: 4, passes: 2}, "
    "{type: back_and_forth, start_m: [0, 0, 3], end_m: [80, 0, 3], speed_m_s: 10, passes: 2}]",
]


def still_air_drag(plant: Plant, airspeed: float) -> float:
    """What the plant's own figures give for a level vehicle whose rotors turn as in hover [m/s^2]."""
    rotors = plant.rotors
    hover = math.sqrt(plant.mass_kg * GRAVITY_M_S2 / (rotors.count * rotors.thrust_coefficient))
    linear = rotors.count * hover * rotors.flapping_kg / plant.mass_kg
    return linear * airspeed + 0.5 * AIR_DENSITY_KG_M3 * plant.drag.area_m2[0] / plant.mass_kg * airspeed**2


@pytest.mark.parametrize("airframe", ["f550", "aurelia_x6"])
def test_a_calm_flight_to_and_fro_shows_the_plants_drag(airframe: str) -> None:
    """A minute with noisy sensors: within 6 % of the plant's curve from 3 to 9 m/s (rotors turn slower in fast air).

    And the shipped airframe says the same, within three of its sigmas and of the short flight's.
    """
    plan = load_plan("drag", airframe, scenario="calm", seed=5, settings=SHORT)
    seen: list[StateEstimate] = []

    def watch(status: Status, _: Cycle) -> None:
        if status.leg_started and status.estimate is not None:
            seen.append(status.estimate)

    assert rehearse(plan, watch=watch)["outcome"] == "completed"
    found = identify_drag([moments(seen)])
    curve = DragCurve(found.drag_1_s, found.drag_1_m)
    assert plan.plant is not None
    assert plan.airframe.wind is not None
    shipped = DragCurve(plan.airframe.wind.drag_1_s, plan.airframe.wind.drag_1_m)
    for airspeed in (3.0, 6.0, 9.0):
        assert curve.force(airspeed) == pytest.approx(still_air_drag(plan.plant, airspeed), rel=0.06)
        by_parts = np.array((airspeed, airspeed**2))
        sigma = math.sqrt(by_parts @ found.covariance @ by_parts)
        own = plan.airframe.wind.drag_sigma_share * shipped.force(airspeed)
        assert abs(curve.force(airspeed) - shipped.force(airspeed)) < 3.0 * math.hypot(sigma, own)
    assert np.abs(found.winds).max() < 0.15
    assert 9.9 < found.fastest_m_s < 10.5


def test_two_flights_in_light_steady_winds_are_told_apart_from_the_drag() -> None:
    """Each with its own wind, both ways at two speeds, without noise: the curve comes back to 0.1 %."""
    true = DragCurve(0.2, 0.015)
    flights = []
    for wind in ((1.0, -0.5), (0.0, 0.7)):
        parts: list[StateEstimate] = []
        for k, speed in enumerate((-9.0, -4.0, 4.0, 9.0)):
            parts += estimates(true, wind, 12.0, velocity=(speed, 0.0), begin_s=100.0 + 20.0 * k)
        flights.append(moments(parts))
    found = identify_drag(flights)
    assert (found.drag_1_s, found.drag_1_m) == pytest.approx((0.2, 0.015), rel=1e-3)
    np.testing.assert_allclose(found.winds, ((1.0, -0.5), (0.0, 0.7)), atol=1e-3)


@pytest.mark.parametrize(("duration_s", "speed", "found"), [(5.0, 9.0, "found 4 s"), (60.0, 1.0, "1.0 m/s")])
def test_too_short_or_too_slow_a_flight_is_refused(duration_s: float, speed: float, found: str) -> None:
    """It says what was expected, what was found and what to fly."""
    flown = moments(estimates(DragCurve(0.2, 0.01), (0.0, 0.0), duration_s, velocity=(speed, 0.0)))
    with pytest.raises(UasflyError, match="fly the mission drag") as refusal:
        identify_drag([flown])
    assert found in str(refusal.value)


def test_no_flight_at_all_is_refused() -> None:
    """Neither a log without estimates nor none."""
    for flights in ([], [moments([])]):
        with pytest.raises(UasflyError, match="found 0 s"):
            identify_drag(flights)


def write_drag_log(log: Path) -> None:
    """Both ways at two speeds, by the curve 0.2 v + 0.015 v^2 in a light wind; on the ground before, by another."""
    writer = LogWriter(log, {})
    curve = DragCurve(0.2, 0.015)
    tracks = [(-9.0, 100.0), (-4.0, 109.0), (4.0, 118.0), (9.0, 127.0)]
    flown = [e for v, begin_s in tracks for e in estimates(curve, (0.5, 0.0), 8.0, velocity=(v, 0.0), begin_s=begin_s)]
    for in_air, part in ((False, estimates(DragCurve(1.0, 0.0), (9.0, 0.0), 2.0, begin_s=90.0)), (True, flown)):
        writer.write(VehicleSample(99.0, FlightMode.OFFBOARD, True, in_air), 99.0)
        for estimate in part:
            writer.write(Status(estimate.time_s, Phase.LEGS, 0, True, 0.5, estimate, None), estimate.time_s)
    writer.close()


def test_the_command_reads_logs_and_prints_the_section(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What it prints is a section of an airframe file; as JSON it has the covariance."""
    log = tmp_path / "flight.mcap"
    write_drag_log(log)
    drag([log], write=None, as_json=False)
    section = capsys.readouterr().out.splitlines()[-1]
    data: Any = parse_yaml(section, "section").data
    found = WindSettings(**data["wind"])
    assert (found.drag_1_s, found.drag_1_m) == pytest.approx((0.2, 0.015), rel=1e-2)
    drag([log], write=None, as_json=True)
    figures = json.loads(capsys.readouterr().out)
    assert figures["winds_m_s"] == [pytest.approx([0.5, 0.0], abs=1e-2)]
    assert np.array(figures["covariance"]).shape == (2, 2)


def test_a_log_in_which_nothing_flew_is_refused(tmp_path: Path) -> None:
    """It names the file."""
    log = tmp_path / "flight.mcap"
    LogWriter(log, {}).close()
    with pytest.raises(FileError, match=r"flight\.mcap: expected a log of a flight"):
        drag([log], write=None, as_json=False)
