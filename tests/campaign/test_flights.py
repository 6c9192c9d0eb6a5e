"""Expansion: which flights, in which order, with which draws and ids."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.campaign.conftest import SHORT, listed
from uasfly.campaign.campaign_file import LogNormal, Normal, Uniform
from uasfly.campaign.draws import draw, scaled
from uasfly.campaign.flights import wind_speed_m_s
from uasfly.drivers.plan import load_plan
from uasfly.files import find_file, load_file
from uasfly.sim.scenario import Scenario

WIND, MASS = "scenario.wind.mean.speed_at_10_m_m_s", "plant.mass_kg"


def test_every_combination_is_there_in_the_order_of_the_file(tmp_path: Path) -> None:
    """Seeds change fastest, then swept values."""
    flights = listed(tmp_path).flights
    assert [(dict(flight.values)[WIND], flight.seed) for flight in flights] == [
        (wind, seed) for wind in (4, 8) for seed in (1, 2, 3)
    ]
    assert [flight.index for flight in flights] == list(range(6))
    assert [flight.wind_m_s for flight in flights] == [4.0] * 3 + [8.0] * 3
    assert len({flight.id for flight in flights}) == 6


def test_a_draw_belongs_to_seed_and_field(tmp_path: Path) -> None:
    """The same seed meets the same vehicle in every wind, and in a campaign of another shape and order."""
    drawn = {(flight.seed, dict(flight.values)[MASS]) for flight in listed(tmp_path).flights}
    assert len(drawn) == 3
    other = SHORT.replace("{ first: 1, count: 3 }", "[9, 3, 2, 1]").replace("[4, 8]", "[12]")
    assert drawn < {(flight.seed, dict(flight.values)[MASS]) for flight in listed(tmp_path, other).flights}


def test_draws_follow_their_distribution() -> None:
    """Mean, spread and bounds of 2000 seeds; figures of the generator are the same on every machine."""
    seeds = range(2000)
    normal = [draw("a", Normal(distribution="normal", mean=2.0, sigma=0.1), seed) for seed in seeds]
    assert np.mean(normal) == pytest.approx(2.0, abs=0.01)
    assert np.std(normal) == pytest.approx(0.1, rel=0.05)
    uniform = [draw("b", Uniform(distribution="uniform", low=-1.0, high=3.0), seed) for seed in seeds]
    assert -1.0 <= min(uniform) < -0.98
    assert 2.98 < max(uniform) <= 3.0
    logs = np.log([draw("c", LogNormal(distribution="lognormal", median=5.0, sigma=0.2), seed) for seed in seeds])
    assert np.mean(logs) == pytest.approx(np.log(5.0), abs=0.02)
    assert np.std(logs) == pytest.approx(0.2, rel=0.05)
    cut = Normal(distribution="normal", mean=0.0, sigma=1.0, least=-0.5, most=0.5)
    assert {min(draws := [draw("d", cut, seed) for seed in seeds]), max(draws)} == {-0.5, 0.5}
    assert draw("plant.mass_kg", Normal(distribution="normal", mean=0.0, sigma=1.0), 1) == DRAWN
    assert abs(np.corrcoef(normal, uniform)[0, 1]) < 0.1


DRAWN = -0.0838288


def test_a_relative_draw_multiplies_numbers_and_lists() -> None:
    """And nothing else."""
    assert scaled(2, 1.5) == 3.0
    assert scaled([1.0, [2.0]], 2.0) == [2.0, [4.0]]
    for base in (None, "text", True, [], [1.0, None]):
        with pytest.raises(ValueError, match="relative needs a number"):
            scaled(base, 2.0)


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("A second of hover", "Other words", True),
        ("tracking_rms_m: 0.05", "tracking_rms_m: 0.5", True),
        ("duration_s: 1\n", "duration_s: 1.0\n", True),
        ("duration_s: 1\n", "duration_s: 2\n", False),
        ("sigma: 0.05", "sigma: 0.06", False),
        ("[nmpc]", "[pid]", False),
        ("first: 1", "first: 4", False),
        ("[4, 8]", "[5, 9]", False),
        ("[f550]", "[iris]", False),
    ],
)
def test_an_id_changes_with_what_decides_the_flight(tmp_path: Path, old: str, new: str, same: bool) -> None:
    """And with nothing else."""
    assert old in SHORT
    before = {flight.id for flight in listed(tmp_path).flights}
    after = {flight.id for flight in listed(tmp_path, SHORT.replace(old, new)).flights}
    assert after == before if same else not after & before


def test_a_plan_is_the_one_of_its_command(tmp_path: Path) -> None:
    """`uasfly rehearse` with the command's words flies the very same."""
    flights = listed(tmp_path)
    words = shlex.split(flights.command(flights.flights[4]))
    assert words[:3] == ["uasfly", "rehearse", "hover"]
    options = dict(zip(words[3:11:2], words[4:12:2], strict=True))
    assert words[11::2] == ["--set"] * 5
    plan = load_plan(
        words[2],
        options["--airframe"],
        controller=options["--controller"],
        seed=int(options["--seed"]),
        scenario=options["--scenario"],
        settings=words[12::2],
    )
    assert plan == flights.plan(flights.flights[4])


@pytest.mark.parametrize(
    ("name", "speed_m_s"), [("calm", 0.0), ("gusty", 8.0), ("head_wind", 14.8), ("gnss_degraded", None)]
)
def test_a_scenario_has_one_figure_for_its_wind(name: str, speed_m_s: float | None) -> None:
    """The mean wind, or the jet where it is aimed at."""
    speed = wind_speed_m_s(load_file(find_file("scenario", name), Scenario).wind)
    assert speed >= 0.0
    if speed_m_s is not None:
        assert speed == speed_m_s
