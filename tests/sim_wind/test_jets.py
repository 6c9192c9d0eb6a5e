"""Blower jets: geometry, speeds, schedule, the following hand and turbulence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.messages import Array
from uasfly.sim.wind.jets import Jet, interpolate, schedule_gate, speed_on_axis
from uasfly.sim.wind.settings import JetSchedule, JetSettings, JetTurbulence, RadialGaussian, RadialTable

STEP_S = 0.004
STILL = JetTurbulence(intensity=0.0)
TABLE = RadialTable(points=((0.0, 1.0), (0.2, 0.5), (0.6, 0.0)))
BLOWER = JetSettings(
    name="blower",
    aim_m=(1.0, 2.0, 3.0),
    distance_m=2.0,
    azimuth_deg=0.0,
    axis_speed=((1.0, 12.0), (3.0, 4.0)),
    radial=TABLE,
    turbulence=STILL,
    schedule=JetSchedule(edge_s=0.0),
)


def changed(**changes: object) -> JetSettings:
    """The blower of this module with other values."""
    return JetSettings.model_validate(BLOWER.model_dump() | changes)


def air(settings: JetSettings, position: tuple[float, float, float], time_s: float | None = 10.0) -> Array:
    """Air of a fresh jet at a place and a time."""
    return np.array(Jet(settings, np.random.default_rng(1), STEP_S).step(position, time_s))


def test_table_is_interpolated_linearly() -> None:
    """Between points the value is linear, on a point it is the point's, outside the end values hold."""
    points = ((1.0, 10.0), (2.0, 20.0), (4.0, 0.0))
    places = (0.0, 1.0, 1.25, 2.0, 3.0, 4.0, 9.0)
    assert [interpolate(points, x) for x in places] == [10.0, 10.0, 12.5, 20.0, 10.0, 0.0, 0.0]


def test_speed_on_the_axis() -> None:
    """Nothing behind the nozzle, the first speed up to the first distance, the table, then 1 / distance."""
    points = ((1.0, 12.0), (3.0, 4.0))
    assert [speed_on_axis(points, d) for d in (-0.01, 0.0, 1.0, 2.0, 3.0, 6.0)] == [0.0, 12.0, 12.0, 8.0, 4.0, 2.0]


@pytest.mark.parametrize(("azimuth_deg", "elevation_deg"), [(0, 0), (90, 0), (-90, 0), (180, 20), (37, -65), (0, 90)])
def test_the_axis_passes_through_the_aim(azimuth_deg: float, elevation_deg: float) -> None:
    """At the aimed point the air moves along azimuth and elevation with the speed of the nozzle's distance."""
    jet = changed(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg)
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    direction = np.array(
        (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
    )
    assert air(jet, jet.aim_m) == pytest.approx(8.0 * direction, abs=1e-12)
    assert np.array(jet.nozzle_in_world) + 2.0 * direction == pytest.approx(np.array(jet.aim_m))
    assert Jet(jet, np.random.default_rng(1), STEP_S).nozzle_in_world == pytest.approx(jet.nozzle_in_world)


def test_speed_off_the_axis_follows_the_table() -> None:
    """The offset is measured square to the axis, in every direction, and beyond the table's end the air is at rest."""
    for offset, fraction in ((0.1, 0.75), (0.2, 0.5), (0.4, 0.25), (0.6, 0.0), (5.0, 0.0)):
        for angle in (0.0, 1.0, 2.5, 4.0):
            place = (1.0, 2.0 + offset * math.cos(angle), 3.0 + offset * math.sin(angle))
            assert air(BLOWER, place) == pytest.approx((8.0 * fraction, 0.0, 0.0), abs=1e-9)


def test_a_table_that_stops_short_of_zero_has_a_sharp_edge() -> None:
    """Beyond the last offset there is nothing, even if its fraction is not 0."""
    jet = changed(radial={"kind": "table", "points": ((0.0, 1.0), (0.3, 1.0))})
    assert air(jet, (1.0, 2.299, 3.0))[0] == 8.0
    assert not air(jet, (1.0, 2.301, 3.0)).any()


def test_gaussian_halves_at_its_growing_half_width() -> None:
    """At half_width_at_nozzle + spread * distance off the axis there is half of the speed on it, at twice that 1/16."""
    jet = changed(radial=RadialGaussian(half_width_at_nozzle_m=0.1, spread=0.2).model_dump())
    for distance, speed in ((1.0, 12.0), (2.0, 8.0), (6.0, 2.0)):
        half_width = 0.1 + 0.2 * distance
        x = -1.0 + distance
        assert air(jet, (x, 2.0, 3.0 + half_width))[0] == pytest.approx(speed / 2)
        assert air(jet, (x, 2.0 - 2 * half_width, 3.0))[0] == pytest.approx(speed / 16)


def test_nothing_blows_behind_the_nozzle() -> None:
    """A vehicle behind the nozzle feels nothing, one just before it does."""
    assert not air(BLOWER, (-1.001, 2.0, 3.0)).any()
    assert air(BLOWER, (-0.999, 2.0, 3.0))[0] == 12.0


def test_schedule_opens_and_closes_with_raised_cosines() -> None:
    """Shut before, half open in the middle of an edge, smooth, open between, and shut after the closing edge."""
    schedule = JetSchedule(start_s=15.0, end_s=35.0, edge_s=0.3)
    gates = {t: schedule_gate(schedule, t) for t in (None, 0.0, 14.99, 15.0, 15.15, 15.3, 30.0, 35.0, 35.15, 35.31)}
    assert list(gates.values()) == pytest.approx([0, 0, 0, 0, 0.5, 1, 1, 1, 0.5, 0], abs=1e-12)
    assert schedule_gate(schedule, 15.1) == pytest.approx(0.5 - 0.5 * math.cos(math.pi / 3))
    times = np.arange(14.0, 37.0, 0.001)
    opened = np.array([schedule_gate(schedule, t) for t in times.tolist()])
    assert np.abs(np.diff(opened)).max() < 0.001 * math.pi / 0.6 + 1e-6
    assert opened.sum() * 0.001 == pytest.approx(20.0, abs=1e-3)


def test_schedule_without_an_end_or_an_edge() -> None:
    """Without an end the jet blows on; with edge 0 it switches."""
    assert schedule_gate(JetSchedule(start_s=2.0), 1e6) == 1.0
    switched = JetSchedule(start_s=2.0, end_s=3.0, edge_s=0.0)
    assert [schedule_gate(switched, t) for t in (1.999, 2.0, 2.999, 3.0)] == [0.0, 1.0, 1.0, 0.0]


def test_a_jet_waits_for_the_stop_watch() -> None:
    """Before the vehicle is first in offboard no jet blows."""
    assert not air(BLOWER, BLOWER.aim_m, time_s=None).any()
    assert air(BLOWER, BLOWER.aim_m, time_s=0.0).any()


def test_a_fixed_jet_stays_where_it_is() -> None:
    """Without `follow` the nozzle does not move, however the vehicle does."""
    jet = Jet(BLOWER, np.random.default_rng(1), STEP_S)
    for _ in range(1000):
        jet.step((5.0, 5.0, 5.0), 1.0)
    assert jet.nozzle_in_world == BLOWER.nozzle_in_world


def test_following_height_lags_by_its_time_constant() -> None:
    """After a step of 1 m the aim's height has moved by 1 - 1/e within one time constant; the rest stays."""
    jet = Jet(changed(follow="height", follow_lag_s=0.3, elevation_deg=20.0), np.random.default_rng(1), STEP_S)
    before = jet.nozzle_in_world
    for _ in range(75):
        jet.step((9.0, 9.0, 4.0), None)
    assert np.subtract(jet.nozzle_in_world, before) == pytest.approx((0.0, 0.0, 1.0 - math.exp(-1.0)), abs=1e-9)


def test_following_the_vehicle_keeps_it_on_the_axis() -> None:
    """A vehicle that stays anywhere for long is at the aimed point of the jet, distance_m from the nozzle."""
    jet = Jet(changed(follow="vehicle", azimuth_deg=40.0, elevation_deg=-30.0), np.random.default_rng(1), STEP_S)
    for _ in range(2000):
        velocity = jet.step((-4.0, 7.0, 1.0), 1.0)
    assert math.hypot(*velocity) == pytest.approx(8.0, rel=1e-6)
    assert math.dist(jet.nozzle_in_world, (-4.0, 7.0, 1.0)) == pytest.approx(2.0, rel=1e-6)


def test_following_without_lag_is_immediate() -> None:
    """With a lag of 0 the first step already aims at the vehicle."""
    jet = Jet(changed(follow="vehicle", follow_lag_s=0.0), np.random.default_rng(1), STEP_S)
    assert jet.step((-4.0, 7.0, 1.0), 1.0) == pytest.approx((8.0, 0.0, 0.0))


def records(settings: JetSettings, place: tuple[float, float, float], seeds: int, steps: int) -> Array:
    """Air (seeds, steps, 3) at a place."""
    jets = [Jet(settings, np.random.default_rng(seed), STEP_S) for seed in range(seeds)]
    return np.array([[jet.step(place, 10.0) for _ in range(steps)] for jet in jets])


def test_turbulence_has_its_intensity_over_seeds() -> None:
    """Along the axis sigma is 15 % of the local mean speed, across it half of that; the mean speed is kept."""
    jet = changed(turbulence=JetTurbulence().model_dump(), azimuth_deg=30.0, elevation_deg=-20.0)
    forward = np.array(jet.direction_in_world)
    side = np.array((-math.sin(math.radians(30.0)), math.cos(math.radians(30.0)), 0.0))
    axes = np.stack((forward, side, np.cross(forward, side)), axis=1)
    offset = 0.2 * side  # half of the speed on the axis
    for place, speed in ((jet.aim_m, 8.0), (tuple((np.array(jet.aim_m) + offset).tolist()), 4.0)):
        along = records(jet, place, seeds=40, steps=4000) @ axes
        assert along.mean(axis=(0, 1)) == pytest.approx((speed, 0.0, 0.0), abs=0.02 * speed)
        assert along.std(axis=(0, 1)) / speed == pytest.approx((0.15, 0.075, 0.075), rel=0.06)


def test_turbulence_is_stationary_from_the_first_step() -> None:
    """Over 1500 seeds the very first step has the intensity of every later one."""
    jet = changed(turbulence=JetTurbulence().model_dump())
    first = records(jet, jet.aim_m, seeds=1500, steps=1)[:, 0]
    assert first.std(axis=0) / 8.0 == pytest.approx((0.15, 0.075, 0.075), rel=0.06)


def test_turbulence_has_its_time_constant() -> None:
    """Length scale 1.5 m at 8 m/s: the autocorrelation falls to 1/e after 0.1875 s (47 steps)."""
    jet = changed(turbulence=JetTurbulence().model_dump())
    record = records(jet, jet.aim_m, seeds=1, steps=150_000)[0]
    record = (record - record.mean(axis=0)) / record.std(axis=0)
    correlation = (record[47:] * record[:-47]).mean(axis=0)
    assert correlation == pytest.approx(np.full(3, math.exp(-47 * 0.004 / 0.1875)), abs=0.05)


def test_turbulence_follows_the_speed_on_the_axis() -> None:
    """Flown from 8 m/s to beyond the table's end, at 2 m/s, the same length scale turns over in 0.75 s."""
    jet = Jet(changed(turbulence=JetTurbulence().model_dump()), np.random.default_rng(0), STEP_S)
    jet.step(BLOWER.aim_m, 10.0)
    record = np.array([jet.step((5.0, 2.0, 3.0), 10.0)[0] for _ in range(250_000)])
    record = (record - record.mean()) / record.std()
    assert (record[188:] * record[:-188]).mean() == pytest.approx(math.exp(-1.0), abs=0.06)


def test_noise_does_not_depend_on_the_flight() -> None:
    """A jet draws the same numbers whether the vehicle is in it, behind it, or the stop watch has not started."""
    generators = [np.random.default_rng(5) for _ in range(3)]
    jets = [Jet(BLOWER, rng, STEP_S) for rng in generators]
    for _ in range(3000):
        jets[0].step((1.0, 2.0, 3.0), 1.0)
        jets[1].step((-9.0, 2.0, 3.0), 1.0)
        jets[2].step((1.0, 2.0, 3.0), None)
    assert len({rng.standard_normal() for rng in generators}) == 1
