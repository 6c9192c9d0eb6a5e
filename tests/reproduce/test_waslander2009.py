"""Waslander & Wang 2009, flown shortly."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from uasfly.errors import UasflyError
from uasfly.frames import quaternion_from_euler, rotation_matrix, rotation_vector_from_quaternion
from uasfly.messages import Array
from uasfly.reproduce import waslander2009
from uasfly.reproduce.rows import SEEDS, Reproduction
from uasfly.reproduce.waslander2009 import vehicle
from uasfly.reproduce.waslander2009.experiments import BY_ACCELEROMETER, BY_OBSERVER, HOVER, Extent, flight_plans
from uasfly.reproduce.waslander2009.flight import PaperFlight, Record, fly
from uasfly.reproduce.waslander2009.sensors import AS_LARGEST, PaperSensors

SHORT = Extent(hover_s=6.0, straight_m=2.0, turns=0.25)
SEED = 3


@pytest.fixture(scope="module")
def hovers() -> dict[str, Record]:
    """The paper's three controllers in six seconds of hover."""
    plans = flight_plans(SEED, SHORT)
    return {name: fly(plan) for (what, name, fed), plan in plans.items() if (what, fed) == (HOVER, BY_ACCELEROMETER)}


@pytest.fixture(scope="module")
def short(hovers: dict[str, Record]) -> Reproduction:
    """Rows of the hovers; they stand for the other flights too, which only the command flies."""
    plans = flight_plans(SEED, SHORT)
    return waslander2009.compare({key: [hovers.get(key[1], hovers["pid_dd_wind"])] * 2 for key in plans}, SHORT)


def test_every_experiment_has_its_rows(short: Reproduction) -> None:
    """Finite figures; a verdict exactly where the paper has a number, and it is the comparison's."""
    assert short.paper == "waslander2009"
    assert {row.experiment for row in short.rows} == {
        "hover",
        "hover, stronger wind",
        "straight path",
        "circular path",
        "wind from accelerometers",
    }
    assert len({(row.experiment, row.quantity) for row in short.rows}) == len(short.rows)
    for row in short.rows:
        assert math.isfinite(row.uasfly)
        assert row.better == (None if row.paper is None else row.uasfly <= row.paper)


def test_all_flights_are_flown_with_five_seeds(hovers: dict[str, Record], monkeypatch: pytest.MonkeyPatch) -> None:
    """From the given one on; progress goes up to one."""
    flown: list[PaperFlight] = []
    told: list[float] = []

    def pretend(plan: PaperFlight) -> Record:
        flown.append(plan)
        return hovers["pid_dd_wind"]

    monkeypatch.setattr(waslander2009, "fly", pretend)
    rows = waslander2009.reproduce(7, lambda _, share: told.append(share)).rows
    assert len(flown) == SEEDS * len(flight_plans(7, SHORT))
    assert {plan.seed for plan in flown} == {7, 8, 9, 10, 11}
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert all(row.note.startswith("5 flights") for row in rows)


def test_the_hover_has_the_papers_order(short: Reproduction) -> None:
    """PID, PID-DD, PID-DD with compensation: each strays less by RMS, the last within the paper's 0.1 m on all axes."""
    values = {row.quantity: row.uasfly for row in short.rows if row.experiment == HOVER}
    assert values["PID-DD + wind: RMS"] < values["PID-DD: RMS"] < values["PID: RMS"]
    assert values["PID-DD + wind: largest deviation of an axis"] <= 0.1


def test_the_filter_finds_the_wind_that_inversion_misses(short: Reproduction) -> None:
    """Horizontally within 0.5 m/s, and nearer than inversion with the bias in it."""
    values = {row.quantity: row.uasfly for row in short.rows}
    filtered = values["filter with bias: RMSE, horizontal"]
    assert filtered < 0.5
    assert filtered < values["inversion, bias untreated: RMSE, horizontal"]


@pytest.mark.parametrize("key", [("straight path", "pid_dd", BY_ACCELEROMETER), ("circular path", "nmpc", BY_OBSERVER)])
def test_the_paths_are_flown(key: tuple[str, str, str]) -> None:
    """A short piece of each, within 0.2 m."""
    plan = flight_plans(SEED, SHORT)[key]
    record = fly(plan)
    assert record.largest().max() < 0.2
    assert np.ptp(record.reference, axis=0).max() > 1.0


def test_the_same_seed_is_the_same_flight(hovers: dict[str, Record]) -> None:
    """Bit for bit, estimates included."""
    again = fly(flight_plans(SEED, SHORT)[HOVER, "pid_dd", BY_ACCELEROMETER])
    np.testing.assert_array_equal(again.position, hovers["pid_dd"].position)
    estimates = hovers["pid_dd"].estimates["sensors"]
    np.testing.assert_array_equal(again.estimates["sensors"]["filtered"], estimates["filtered"])


def test_legs_that_are_not_flown_to_their_end_are_an_error() -> None:
    """Outside of its fence the flight ends early, and says so."""
    plan = flight_plans(SEED, Extent(straight_m=8.0))["straight path", "pid_dd", BY_ACCELEROMETER]
    geofence = plan.mission.limits.geofence
    assert geofence is not None
    fence = plan.mission.limits.model_copy(update={"geofence": geofence.model_copy(update={"radius_m": 0.5})})
    with pytest.raises(UasflyError, match="expected the legs to be flown to their end"):
        fly(replace(plan, mission=plan.mission.model_copy(update={"limits": fence})))


def test_pictures_are_drawn_when_asked_for(short: Reproduction, tmp_path: Path) -> None:
    """Each a PNG of its own name."""
    pytest.importorskip("matplotlib")
    assert set(short.pictures) == {"hover", "hover_stronger", "wind", "straight", "circle"}
    for stem, draw in short.pictures.items():
        draw(tmp_path / f"{stem}.png")
        assert (tmp_path / f"{stem}.png").read_bytes().startswith(b"\x89PNG")


def _turning(steps: int) -> list[Array]:
    return [quaternion_from_euler(0.1 * math.sin(0.05 * n), 0.08 * math.cos(0.03 * n), 0.02 * n) for n in range(steps)]


def test_sensors_have_the_errors_that_are_stated() -> None:
    """Accelerometer: bias and 0.1 g; GPS 5, 5, 10 cm; barometer 30 cm, over thousands of samples."""
    level = np.array((1.0, 0.0, 0.0, 0.0))
    sensors = PaperSensors(AS_LARGEST, np.random.default_rng(1), level)
    count = 4000
    force = np.array([sensors.specific_force(np.array((0.5, 0.0, 0.0)), level) for _ in range(count)])
    np.testing.assert_allclose(force.mean(axis=0) - (0.5, 0.0, 9.80665), sensors.bias, atol=0.06)
    np.testing.assert_allclose(np.abs(sensors.bias), 0.1)
    np.testing.assert_allclose(force.std(axis=0), 0.980665, rtol=0.05)
    gps = np.array([sensors.gps(np.array((1.0, 2.0, 3.0))) for _ in range(count)])
    np.testing.assert_allclose(gps.std(axis=0), (0.05, 0.05, 0.1), rtol=0.05)
    assert np.std([sensors.barometer(2.0) for _ in range(count)]) == pytest.approx(0.3, rel=0.05)


def test_the_attitude_keeps_its_tilt_error_and_finds_its_heading() -> None:
    """A minute of turning: the tilt error stays as it was in the world within 0.2 deg, the heading within 0.6 deg."""
    path = _turning(3000)
    sensors = PaperSensors(AS_LARGEST, np.random.default_rng(2), path[0])

    def error(quaternion: Array) -> Array:
        turned = rotation_matrix(sensors.quaternion) @ rotation_matrix(quaternion).T
        twice = np.array((turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]))
        return np.asarray(np.degrees(twice) / 2)

    before = error(path[0])
    for quaternion in path[1:]:
        sensors.turn(quaternion)
    after = error(path[-1])
    assert np.abs(after[:2] - before[:2]).max() < 0.2
    assert abs(after[2]) < 0.6
    assert np.linalg.norm(rotation_vector_from_quaternion(sensors.quaternion)) > 0.1


def test_the_model_has_the_plants_coefficients_by_hand() -> None:
    """Hover at 509.3 rad/s: 6 * 1.42e-4 * 509.3 / 1.8 = 0.2411 1/s; 1.225 / 2 * 0.04555 / 1.8 = 0.0155 1/m."""
    _, plant = vehicle.load_vehicle()
    model = vehicle.accelerometer_model(plant)
    assert model.in_plane_1_s == pytest.approx(0.2411, abs=2e-4)
    assert model.quadratic_1_m == pytest.approx(0.01550, abs=1e-5)
    assert model.disc_area_per_mass_m2_kg == pytest.approx(6 * math.pi * 0.12**2 / 1.8)
    assert vehicle.accelerometer_model(plant, 1.1).in_plane_1_s == pytest.approx(1.1 * model.in_plane_1_s)


def test_the_wind_is_the_papers_at_fifteen_knots() -> None:
    """7.72 m/s at 20 ft make 5.93 m/s at 2 m: 7.72 ln 40 / ln 121.9; the profile reaches far above."""
    wind = vehicle.paper_scenario(vehicle.LIGHT_M_S).wind
    assert wind.gusts == "sum_of_sines"
    assert wind.mean.w20_m_s == pytest.approx(7.717, abs=1e-3)
    assert wind.mean.kind == "boundary_layer"
    assert wind.mean.speed_at_10_m_m_s * math.log(40.0) / math.log(200.0) == pytest.approx(5.926, abs=2e-3)
    assert wind.mean.top_m(45.0) > 100.0
    assert vehicle.gust_density(vehicle.LIGHT_M_S) == pytest.approx((0.389, 0.389, 0.668), abs=2e-3)
