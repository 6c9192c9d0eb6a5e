"""The shipped scenarios blow what the paper states, where it states it (turbulence off)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.files import find_file, load_file, shipped_names
from uasfly.messages import Array
from uasfly.sim.scenario import Scenario
from uasfly.sim.wind import WindField, WindSettings

Place = tuple[float, float, float]
STEP_S = 0.004
REST = (0.0, 0.0, 0.0)
JET_SCENARIOS = ("blower_hover", "head_wind", "side_gust", "spiral_side", "spiral_up", "spiral_down")


def shipped(name: str) -> Scenario:
    """A shipped scenario."""
    return load_file(find_file("scenario", name), Scenario)


def without_turbulence(settings: WindSettings) -> WindSettings:
    """The same jets, steady."""
    data = settings.model_dump()
    for jet in data["jets"]:
        jet["turbulence"]["intensity"] = 0.0
    return WindSettings.model_validate(data)


def jet_at(name: str, place: Place, time_s: float = 60.0, arrival_s: float = 5.0) -> Array:
    """Steady jet air at a place where the vehicle has been for `arrival_s` (for the hand to follow)."""
    field = WindField(without_turbulence(shipped(name).wind), np.random.default_rng(1), STEP_S)
    for _ in range(round(arrival_s / STEP_S)):
        wind = field.step(place, REST, time_s)
    return np.array(wind.jet_in_world)


def test_all_scenarios_of_the_list_are_shipped() -> None:
    """The shipped scenarios are the nine of the list, each named as its file."""
    names = ["blower_hover", "calm", "gnss_degraded", "gusty", "head_wind", "side_gust"]
    assert shipped_names("scenario") == [*names, "spiral_down", "spiral_side", "spiral_up"]
    assert [shipped(name).name for name in shipped_names("scenario")] == shipped_names("scenario")


@pytest.mark.parametrize("name", shipped_names("scenario"))
def test_sensors_are_of_motion_capture_quality_except_with_degraded_gnss(name: str) -> None:
    """Position noise is 1 cm everywhere but in gnss_degraded."""
    sensors = shipped(name).sensors
    assert (sensors.position == "gnss") == (name == "gnss_degraded")
    assert sensors.gnss is not None or sensors.position_white_sigma_m == 0.01


@pytest.mark.parametrize("name", JET_SCENARIOS)
def test_jets_have_fifteen_per_cent_turbulence_and_short_edges(name: str) -> None:
    """Every shipped jet has 15 % turbulence and edges of 0.3 s, in otherwise still air."""
    wind = shipped(name).wind
    assert wind.mean.w20_m_s == 0.0
    assert {(jet.turbulence.intensity, jet.schedule.edge_s) for jet in wind.jets} == {(0.15, 0.3)}


@pytest.mark.parametrize(("name", "speed"), [("gusty", 8.0), ("gnss_degraded", 2.0)])
def test_natural_wind_has_its_mean_at_ten_metres(name: str, speed: float) -> None:
    """At 10 m gusty blows 8 m/s, gnss_degraded 2 m/s, by the boundary layer, with Dryden gusts."""
    wind = shipped(name).wind
    steady = WindField(WindSettings(mean=wind.mean), np.random.default_rng(1), STEP_S)
    assert wind.gusts == "dryden"
    assert wind.jets == ()
    assert math.hypot(*steady.step((0.0, 0.0, 10.0), REST, None).free_in_world) == pytest.approx(speed)
    ratio = math.log(1.5 / 0.05) / math.log(200.0)
    assert math.hypot(*steady.step((0.0, 0.0, 1.5), REST, None).free_in_world) == pytest.approx(ratio * speed)


def test_calm_is_calm() -> None:
    """Nothing blows in calm."""
    wind = WindField(shipped("calm").wind, np.random.default_rng(1), STEP_S).step((0.0, 0.0, 1.5), REST, 10.0)
    assert wind.free_in_world == wind.jet_in_world == REST


@pytest.mark.parametrize(
    ("time_s", "expected"),
    [
        (14.99, REST),
        (15.15, (5.0, 0.0, 0.0)),
        (15.3, (10.0, 0.0, 0.0)),
        (34.99, (10.0, 0.0, 0.0)),
        (35.15, (5.0, 0.0, 0.0)),
        (35.31, REST),
        (44.99, REST),
        (45.3, (0.0, -7.0, 0.0)),
        (64.99, (0.0, -7.0, 0.0)),
        (65.31, REST),
        (74.99, REST),
        (75.3, (10.0 * math.cos(math.pi / 6), 0.0, -5.0)),
        (94.99, (10.0 * math.cos(math.pi / 6), 0.0, -5.0)),
        (95.31, REST),
        (105.0, REST),
    ],
)
def test_blower_hover_keeps_its_timetable(time_s: float, expected: Place) -> None:
    """10 m/s toward +x, 7 m/s toward -y, 10 m/s toward +x and 30 deg down: 20 s each from 15, 45 and 75 s on."""
    assert jet_at("blower_hover", (0.0, 0.0, 1.5), time_s) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("time_s", [20.0, 50.0, 80.0])
def test_blower_hover_reaches_a_hover_half_a_metre_off(time_s: float) -> None:
    """Within 0.5 m of the hover in x, y or z the air has the stated speed before the hand has followed, and after."""
    stated = jet_at("blower_hover", (0.0, 0.0, 1.5), time_s)
    for off in ((0.5, 0, 0), (-0.5, 0, 0), (0, 0.5, 0), (0, -0.5, 0), (0, 0, 0.5), (0, 0, -0.5)):
        place = (off[0], off[1], 1.5 + off[2])
        assert jet_at("blower_hover", place, time_s, arrival_s=STEP_S) == pytest.approx(stated, abs=1e-9)
        assert jet_at("blower_hover", place, time_s) == pytest.approx(stated, abs=1e-9)


def test_head_wind_has_the_papers_speeds_at_both_ends() -> None:
    """14.8 m/s at the negative end of the track, 5.5 m/s at the positive end, falling steadily between, toward +x."""
    assert jet_at("head_wind", (-1.0, 0.0, 1.5)) == pytest.approx((14.8, 0.0, 0.0), abs=1e-9)
    assert jet_at("head_wind", (1.0, 0.0, 1.5)) == pytest.approx((5.5, 0.0, 0.0), abs=1e-9)
    speeds = [jet_at("head_wind", (x, 0.0, 1.5), arrival_s=STEP_S)[0] for x in np.linspace(-1.2, 1.2, 49).tolist()]
    assert (np.diff(speeds) < 0.0).all()


@pytest.mark.parametrize(("x", "speed"), [(0.0, 13.4), (0.25, 6.7), (-0.25, 6.7), (0.6, 0.0), (-0.6, 0.0), (-1.0, 0.0)])
def test_side_gust_crosses_the_middle_of_the_track(x: float, speed: float) -> None:
    """Toward -y: 13.4 m/s on the axis, half of it 0.25 m off the axis, nothing 0.6 m off."""
    assert jet_at("side_gust", (x, 0.0, 1.5)) == pytest.approx((0.0, -speed, 0.0), abs=1e-9)


@pytest.mark.parametrize(("name", "elevation_deg"), [("spiral_side", 0.0), ("spiral_up", 20.0), ("spiral_down", -20.0)])
@pytest.mark.parametrize("height_m", [0.75, 1.5, 2.25])
def test_spiral_jets_cross_the_path_at_every_height(name: str, elevation_deg: float, height_m: float) -> None:
    """At (-1, 0) and any height of the spiral: 13.4 m/s outward, level or 20 deg up or down; nothing 0.6 m beside."""
    elevation = math.radians(elevation_deg)
    expected = np.array((-13.4 * math.cos(elevation), 0.0, 13.4 * math.sin(elevation)))
    assert jet_at(name, (-1.0, 0.0, height_m)) == pytest.approx(expected, abs=1e-4)
    assert jet_at(name, (-1.0, 0.25, height_m)) == pytest.approx(0.5 * expected, abs=1e-4)
    assert not jet_at(name, (-1.0, -0.6, height_m)).any()


@pytest.mark.parametrize("name", ["spiral_side", "spiral_up", "spiral_down"])
def test_spiral_jets_leave_the_rest_of_the_circle_alone(name: str) -> None:
    """The nozzle is inside the circle; 40 deg or more from (-1, 0) along the path, and at the centre, nothing blows."""
    nozzle = shipped(name).wind.jets[0].nozzle_in_world
    assert -1.0 < nozzle[0] < 0.0
    assert nozzle[1] == pytest.approx(0.0, abs=1e-12)
    assert not jet_at(name, (0.0, 0.0, 1.5)).any()
    for degrees in range(40, 321, 10):
        angle = math.pi + math.radians(degrees)
        assert not jet_at(name, (math.cos(angle), math.sin(angle), 1.5), arrival_s=STEP_S).any()


@pytest.mark.parametrize("name", ["spiral_side", "spiral_up", "spiral_down"])
def test_the_hand_follows_a_climb_closely(name: str) -> None:
    """At the spiral's climb of 1.5 m in 120 s the hand is 4 mm behind: the speed at the path stays 13.4 m/s."""
    field = WindField(without_turbulence(shipped(name).wind), np.random.default_rng(1), STEP_S)
    for index in range(5000):
        time_s = index * STEP_S
        wind = field.step((-1.0, 0.0, 1.0 + 0.0125 * time_s), (0.0, 0.0, 0.0125), time_s)
    assert math.hypot(*wind.jet_in_world) == pytest.approx(13.4, rel=0.01)
