"""What has been seen of a flight lately: rates over the last seconds, medians, and the notes."""

from __future__ import annotations

import math

import pytest

from tests.cli.scenes import status
from uasfly.cli.scene import Recent, Scene
from uasfly.drivers.plan import load_plan
from uasfly.drivers.watching import Cycle


def _seen(recent: Recent) -> Scene:
    found = recent.scene()
    assert found is not None
    return found


def test_there_is_no_scene_before_the_first_step() -> None:
    """And none of its rates in it."""
    recent = Recent("uasfly")
    assert recent.scene() is None
    recent.take(status(100.0), Cycle(False, 1.0, None))
    first = _seen(recent)
    assert first.clock_s == 0.0
    assert math.isnan(first.cycle_hz)
    assert math.isnan(first.solve_ms)
    assert math.isnan(first.period_ms)


def test_rates_are_those_of_the_last_seconds() -> None:
    """Fifty cycles a second; setpoints stop and their rate falls to nothing."""
    recent = Recent("uasfly")
    for k in range(501):
        recent.take(status(100.0 + 0.02 * k), Cycle(k < 300, 2.0, 1.0 if k < 300 else None))
        if k == 299:
            assert _seen(recent).sent_hz == pytest.approx(50.0, abs=0.6)
    last = _seen(recent)
    assert last.cycle_hz == pytest.approx(50.0, abs=0.6)
    assert last.sent_hz == 0.0
    assert last.clock_s == pytest.approx(10.0)
    assert last.solve_ms == 1.0
    assert math.isnan(last.last_solve_ms)


def test_notes_are_newest_first_and_repetitions_take_one_line() -> None:
    """With the time of the last one."""
    recent = Recent("uasfly")
    recent.take(status(100.0, announcements=((6, "phase legs"),)), Cycle(True, 1.0, 1.0))
    for k in range(1, 4):
        recent.take(status(100.0 + k, announcements=((4, "gust"),)), Cycle(True, 1.0, 1.0))
    notes = _seen(recent).notes
    assert [(note.text, note.times, note.clock_s) for note in notes] == [("gust", 3, 3.0), ("phase legs", 1, 0.0)]


def test_the_plan_gives_names_and_rate() -> None:
    """Legs without a name have that of their kind."""
    recent = Recent("uasfly")
    recent.plan(load_plan("back_and_forth", "f550", scenario="gusty"))
    recent.take(status(), Cycle(True, 1.0, 1.0))
    assert _seen(recent).title == "uasfly · back_and_forth · f550 · gusty"
    assert _seen(recent).legs == ("back and forth",)
    assert _seen(recent).period_ms == pytest.approx(20.0)
