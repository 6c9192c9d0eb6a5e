"""Campaign files: what may stand in them, and what is said about those that cannot be flown."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.campaign.conftest import SHORT, listed, write_campaign
from uasfly.campaign.campaign_file import Campaign
from uasfly.errors import UasflyError
from uasfly.files import load_file


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("airframes: [f550]", "airframes: []", "line 2: airframes: expected a list of texts"),
        ("airframes: [f550]", "airframes: f550", "line 2: airframes: expected a list of texts"),
        ("airframes: [f550]\n", "", "airframes is missing"),
        ("airframes: [f550]", "airframe: [f550]", "airframe is not a known field; did you mean airframes?"),
        ("airframes: [f550]", "airframes: [f551]", "line 2: airframes[0] f551: there is no airframe of this name"),
        ("airframes: [f550]", "airframes: [f551]", "did you mean f550?"),
        (
            "missions: [hover]",
            "missions: [hover, no/one.yaml]",
            "line 3: missions[1] no/one.yaml: there is no such file",
        ),
        ("missions: [hover]", "missions: [hover, hover]", 'missions: "hover" appears twice; remove one'),
        (
            "controllers: [nmpc]",
            "controllers: [lqr]",
            "line 5: controllers[0]: expected one of nmpc, pid, pid_dd, pid_dd_wind, found 'lqr'",
        ),
        ("count: 3", "count: 0", "line 6: seeds.count: expected a whole number, not below 1"),
        ("{ first: 1, count: 3 }", "{ first: 1 }", "line 6: seeds: expected either count (with first) or values"),
        ("{ first: 1, count: 3 }", "[1, one]", "line 6: seeds.values[1]: expected a whole number"),
        ("{ first: 1, count: 3 }", "[1, 2, 1]", "line 6: seeds: 1 appears twice"),
        (
            "count: 3",
            "count: 60000",
            "120000 flights (1 airframe x 1 mission x 1 scenario x 1 controller x 2 values of",
        ),
        ("count: 3", "count: 60000", "expected at most 100000: use fewer seeds"),
        ("[4, 8]", "[]", "overrides.swept.scenario.wind.mean.speed_at_10_m_m_s: expected a list of values"),
        ("[4, 8]", "[4, 4]", "4 appears twice"),
        ("[4, 8]", "[4, fast]", "line 13: overrides.swept.scenario.wind.mean.speed_at_10_m_m_s: expected a number"),
        ("[4, 8]", "[4, fast]", "found 'fast' (value: \"fast\""),
        ("speed_at_10_m_m_s: [", "speed_at_10: [", "line 13: overrides.swept.scenario.wind.mean.speed_at_10 is not"),
        ("plant.mass_kg:", "plane.mass_kg:", "expected fields that begin with airframe., mission., scenario., plant."),
        ("plant.mass_kg:", "plant.mass:", "line 15: overrides.scattered.plant.mass: relative needs a number"),
        ("plant.mass_kg:", "plant.[0:", "is not the path of a field"),
        ("mission.legs[0].duration_s: 1", "mission.legs[7].duration_s: 1", "line 11: overrides.fixed.mission.legs[7]"),
        ("mission.legs[0].duration_s: 1", "mission.legs[7].duration_s: 1", "legs has 1 items"),
        ("mission.legs[0].duration_s: 1", "plant.mass_kg: 1.8", "plant.mass_kg appears twice; keep it in one of"),
        ("distribution: normal", "distribution: gauss", "distribution: expected one of normal, uniform, lognormal"),
        ("sigma: 0.05", "sigma: -1", "line 15: overrides.scattered.plant.mass_kg.sigma: expected a number"),
        ("mean: 1.0, sigma: 0.05", "mean: -1.0, sigma: 0.05", "line 15: overrides.scattered.plant.mass_kg: expected"),
        ("normal, mean: 1.0, sigma: 0.05", "uniform, low: 2, high: 1", "high must not be below low = 2, found 1"),
        ("mission.takeoff.height_m: 1.0", "mission.limits.altitude_max_m: 1.0", "mission hover is not for"),
        (
            "{ tracking_rms_m: 0.05 }",
            "{ tracking_rms_m: 0 }",
            "line 16: success.tracking_rms_m: expected a number, above",
        ),
        ("airframes: [f550]", "airframes: [f550", "not valid YAML"),
    ],
)
def test_a_campaign_that_cannot_be_flown_says_where_and_why(tmp_path: Path, old: str, new: str, expected: str) -> None:
    """File, line, field, what was expected, what was found."""
    assert old in SHORT
    with pytest.raises(UasflyError) as caught:
        listed(tmp_path, SHORT.replace(old, new))
    assert expected in " ".join(str(caught.value).split())
    assert "short.yaml: line" in str(caught.value)


def test_a_wrong_file_of_a_campaign_is_named_itself(tmp_path: Path) -> None:
    """A mistake in a mission is one of the mission's, not of the campaign's."""
    (tmp_path / "mine.yaml").write_text("name: mine\nlegs: []\n")
    with pytest.raises(UasflyError, match=r"mine\.yaml: line 2: legs"):
        listed(tmp_path, SHORT.replace("missions: [hover]", "missions: [mine.yaml]"))


def test_seeds_are_a_count_or_a_list(tmp_path: Path) -> None:
    """Both ways of writing them."""
    counted = load_file(write_campaign(tmp_path), Campaign)
    assert counted.seeds.all() == [1, 2, 3]
    text = SHORT.replace("{ first: 1, count: 3 }", "[7, 3]")
    assert load_file(write_campaign(tmp_path, text), Campaign).seeds.all() == [7, 3]


def test_a_file_beside_the_campaign_comes_first(tmp_path: Path) -> None:
    """Names are looked up in the campaign's own folder, and the command names the file as seen from here."""
    (tmp_path / "mine.yaml").write_text(
        "name: mine\nlegs: [{type: hover, position_m: [0, 0, 1.5], duration_s: 5}]\ntakeoff: {height_m: 1.5}\n"
        "yaw: {rule: fixed, yaw_deg: 0}\nending: {action: land}\n"
        "limits: {geofence: {radius_m: 5}, altitude_min_m: 0.5, altitude_max_m: 5}\n"
    )
    flights = listed(tmp_path, SHORT.replace("missions: [hover]", "missions: [mine.yaml]"))
    flight = flights.flights[0]
    assert flight.mission == "mine.yaml"
    assert f"uasfly rehearse {tmp_path / 'mine.yaml'} " in flights.command(flight)
