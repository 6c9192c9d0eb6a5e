"""Kalaitzakis & Vitzilaios 2023: one short flight, and the rows and verdicts that come of figures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.reproduce import kalaitzakis2023, report
from uasfly.reproduce.kalaitzakis2023 import experiments as e
from uasfly.reproduce.kalaitzakis2023 import flight
from uasfly.reproduce.kalaitzakis2023.flight import Record, fly
from uasfly.reproduce.kalaitzakis2023.results import all_rows, force_agrees, force_rows
from uasfly.reproduce.rows import SEEDS, Reproduction, Row, mean_row
from uasfly.sim.scenario import Scenario

SEED = 2


@pytest.fixture(scope="module")
def short() -> Record:
    """Five seconds above the markers."""
    return fly(e.flight_plan(e.EXPERIMENTS[e.MARKERS], SEED, ("mission.legs[0].duration_s=5",)))


@pytest.fixture(scope="module")
def blowers() -> Scenario:
    """The scenario of the hover before a blower."""
    scenario = e.flight_plan(e.EXPERIMENTS[e.BLOWER], SEED).scenario
    assert scenario is not None
    return scenario


@pytest.fixture(scope="module")
def reproduction(short: Record, blowers: Scenario) -> Reproduction:
    """The short flight stands for all; only the command flies the others."""
    records = {name: [short, short] for name in e.EXPERIMENTS}
    records[e.BLOWER] = [_blown((1.5, 0.0, 0.0), (0.0, -0.8, 0.0), (1.3, 0.0, -0.8))] * 2
    records[e.PAPER_GRID] = [short]
    return kalaitzakis2023.compare(records, blowers)


def _blown(*forces: Sequence[float], summary: dict[str, Any] | None = None) -> Record:
    """A hover whose estimated force is one of these while a blower has settled, and far off outside of that."""
    time_s = np.arange(0.0, 105.0, 0.5)
    force = np.full((len(time_s), 3), 9.0)
    for (begin_s, end_s), value in zip(((18.3, 35.0), (48.3, 65.0), (78.3, 95.0)), forces, strict=True):
        force[(time_s >= begin_s) & (time_s <= end_s)] = value
    still: Array = np.zeros((len(time_s), 3))
    total = {"tracking_rms_m": {"total": 0.05}, "tracking_max_m": 0.1}
    no_marker = np.full_like(still, math.nan)
    return Record(
        total if summary is None else summary,
        offboard_s=12.0,
        time_s=time_s + 12.0,
        truth=still,
        reference=still,
        estimate=still,
        gnss=still,
        placed=no_marker,
        force_estimated=force,
        force_true=still,
        solve_ms=np.array((0.5, 1.5)),
    )


def test_a_short_flight_is_recorded(short: Record) -> None:
    """A row a cycle of the legs; its errors are the summary's, as seen from the marker; GNSS is worse."""
    cycles = len(short.time_s)
    assert 245 <= cycles <= 255
    for values in (short.truth, short.reference, short.estimate, short.gnss, short.placed, short.force_true):
        assert values.shape == (cycles, 3)
        assert np.isfinite(values).all()
    assert 5.0 < short.offboard_s < short.time_s[0]
    by_marker = short.summary["by_marker"]
    flown_m = math.sqrt((short.error**2).sum(axis=1).mean())
    assert flown_m == pytest.approx(by_marker["tracking_rms_m"]["total"], rel=0.1)
    estimate_m = math.sqrt(((short.estimate - short.placed) ** 2).sum(axis=1).mean())
    assert estimate_m == pytest.approx(by_marker["estimate_rms_m"]["total"], rel=0.1)
    assert by_marker["estimate_rms_m"]["total"] < 0.03 < short.summary["gnss_rms_m"]["total"]
    assert len(short.solve_ms) >= cycles
    assert (short.solve_ms > 0.0).all()


def test_every_experiment_has_its_rows(reproduction: Reproduction) -> None:
    """Finite figures, one row a quantity, JSON that is JSON; a verdict exactly where the paper has a number."""
    rows = reproduction.rows
    assert reproduction.paper == "kalaitzakis2023"
    assert {row.experiment for row in rows} == {experiment.title for experiment in e.EXPERIMENTS.values()}
    assert len({(row.experiment, row.quantity) for row in rows}) == len(rows)
    for row in rows:
        assert math.isfinite(row.uasfly)
        assert (row.better is None) == (row.paper is None)
    json.dumps(report.as_json(reproduction), allow_nan=False)


def test_the_papers_figures_are_all_there(reproduction: Reproduction) -> None:
    """Each with its unit."""
    found = {(row.experiment, row.paper, row.unit) for row in reproduction.rows if row.paper is not None}
    spirals = zip(e.SPIRALS, (10.4, 11.4, 10.2, 9.2), strict=True)
    wanted = {
        ("hover over markers", 0.13, "m"),
        ("hover before a blower", 13.2, "cm"),
        ("hover before a blower", 1.5, "m/s^2"),
        ("hover before a blower", -0.8, "m/s^2"),
        ("back and forth, head wind", 7.6, "cm"),
        ("back and forth, side gust", 7.4, "cm"),
        *((e.EXPERIMENTS[name].title, paper, "cm") for name, paper in spirals),
        *(("field hover by a board", paper, "cm") for paper in (12.0, 23.0, 16.0)),
        ("NMPC step", 15.0, "ms"),
    }
    assert wanted <= found
    assert [paper for _, paper, _ in found - wanted] == [pytest.approx(0.13 / 1.28)]


@pytest.mark.parametrize(("rms_m", "better"), [((0.13, 0.1315), True), ((0.13, 0.135), False)])
def test_the_mean_of_the_flights_decides(
    short: Record, blowers: Scenario, rms_m: tuple[float, float], better: bool
) -> None:
    """13.2 cm are met by a mean of 13.08 cm and missed by one of 13.25 cm; the note tells the spread."""
    records = {name: [short] for name in e.EXPERIMENTS}
    hovers = [{"tracking_rms_m": {"total": value}, "tracking_max_m": 0.2} for value in rms_m]
    force = ((1.5, 0.0, 0.0), (0.0, -0.8, 0.0), (1.3, 0.0, -0.8))
    records[e.BLOWER] = [_blown(*force, summary=summary) for summary in hovers]
    row = _row(all_rows(records, blowers), "hover before a blower", "position, RMS")
    assert row.uasfly == pytest.approx(100.0 * np.mean(rms_m))
    assert row.better is better
    assert f"13 to {100.0 * rms_m[1]:.3g}" in row.note


def test_forces_are_read_where_a_blower_has_settled(blowers: Scenario) -> None:
    """The plateau's mean, on the stop watch that starts with offboard; what is outside of it does not count."""
    rows = force_rows([_blown((1.5, 0.1, 0.2), (0.0, -0.8, 0.0), (1.3, 0.0, -0.8))], _schedules(blowers))
    assert _row(rows, "hover before a blower", "force of blower 1, x").uasfly == pytest.approx(1.5)
    assert _row(rows, "hover before a blower", "force of blower 1, y").uasfly == pytest.approx(0.1)
    assert _row(rows, "hover before a blower", "force of blower 3, z").uasfly == pytest.approx(-0.8)
    assert [row.better for row in rows if row.paper is not None] == [True, True]


def test_forces_on_the_wrong_axis_or_of_the_wrong_sign_are_told(blowers: Scenario) -> None:
    """1.5 on y instead of x, and +0.8 for -0.8: both rows say no."""
    rows = force_rows([_blown((0.0, 1.5, 0.0), (0.0, 0.8, 0.0), (1.3, 0.0, -0.8))], _schedules(blowers))
    assert [row.better for row in rows if row.paper is not None] == [False, False]


@pytest.mark.parametrize(
    ("ours", "theirs", "agrees"),
    [(1.28, 1.5, True), (1.72, 1.5, True), (1.73, 1.5, False), (-0.69, -0.8, True), (-0.67, -0.8, False)],
)
def test_a_force_agrees_within_fifteen_per_cent(ours: float, theirs: float, agrees: bool) -> None:
    """Of the paper's size, either way."""
    assert force_agrees(ours, theirs) is agrees


def test_without_a_figure_of_the_paper_there_is_no_verdict() -> None:
    """And one flight has no spread."""
    row = mean_row("hover", "speed", "m/s", None, [2.0], "not stated")
    assert row == Row("hover", "speed", "m/s", None, 2.0, None, "one flight; not stated")


def test_all_seeds_of_all_experiments_are_flown(short: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    """Five from the given one on, once where one is enough; progress goes up to one."""
    flown: list[tuple[str, int]] = []
    told: list[float] = []
    hover = _blown((1.5, 0.0, 0.0), (0.0, -0.8, 0.0), (1.3, 0.0, -0.8), summary=dict(short.summary))

    def pretend(plan: Any, tell: Any) -> Record:
        flown.append((plan.scenario.name, plan.seed))
        tell(0.5)
        return hover if plan.scenario.name == "blower_hover" else short

    monkeypatch.setattr(kalaitzakis2023, "fly", pretend)
    kalaitzakis2023.reproduce(7, lambda text, share: told.append(share))
    assert len(flown) == SEEDS * (len(e.EXPERIMENTS) - 1) + 1
    assert [seed for name, seed in flown if name == "head_wind"] == [7, 8, 9, 10, 11]
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.parametrize(
    ("summary", "match"),
    [
        ({"outcome": "aborted", "reason": "battery at 20 %"}, "flown to its end, found it aborted: battery at 20 %"),
        ({"outcome": "completed", "by_marker": None}, "expected markers to be seen"),
    ],
)
def test_a_flight_that_shows_nothing_is_an_error(
    monkeypatch: pytest.MonkeyPatch, summary: dict[str, Any], match: str
) -> None:
    """It does not become a row."""
    monkeypatch.setattr(flight, "rehearse", lambda *_, **__: summary)
    with pytest.raises(UasflyError, match=match):
        fly(e.flight_plan(e.EXPERIMENTS[e.MARKERS], SEED))


def test_settings_of_the_experiments_reach_their_files() -> None:
    """The solver's grid is the paper's; in the field GNSS is sound at first, and the wind blows across the view."""
    plan = e.flight_plan(e.EXPERIMENTS[e.PAPER_GRID], SEED)
    controller = plan.airframe.controller
    assert (controller.nodes, controller.first_interval_s, controller.horizon_s) == (60, 0.05, 3.0)
    field = e.flight_plan(e.EXPERIMENTS[e.FIELD], SEED)
    assert field.airframe.mass_kg == 9.3
    assert field.sight is not None
    assert field.sight.modelled
    assert field.scenario is not None
    assert field.scenario.sensors.gnss is not None
    assert field.scenario.sensors.gnss.walk_from_s == 5.0
    assert field.scenario.wind.mean.kind == "boundary_layer"
    assert field.scenario.wind.mean.toward_deg == 90.0


def test_pictures_are_drawn_when_asked_for(reproduction: Reproduction, tmp_path: Path) -> None:
    """Each a PNG of its own name."""
    pytest.importorskip("matplotlib")
    assert {"localisation", "disturbance", "spirals", "errors", "position_field"} <= set(reproduction.pictures)
    for stem in ("localisation", "disturbance", "spirals", "errors", "position_field"):
        reproduction.pictures[stem](tmp_path / f"{stem}.png")
        assert (tmp_path / f"{stem}.png").read_bytes().startswith(b"\x89PNG")


def _schedules(scenario: Scenario) -> list[Any]:
    return [jet.schedule for jet in scenario.wind.jets]


def _row(rows: Sequence[Row], experiment: str, quantity: str) -> Row:
    (found,) = (row for row in rows if (row.experiment, row.quantity) == (experiment, quantity))
    return found
