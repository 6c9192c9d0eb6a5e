"""A part of the campaign on every run of the tests; `python -m tests.fuzz` runs all of it."""

from __future__ import annotations

import os

import pytest

from tests.fuzz.campaign import TARGETS, run
from tests.fuzz.harness import Tally
from tests.fuzz.live import bombard

SEED = int(os.environ.get("UASFLY_FUZZ_SEED", "1"))
INPUTS = {"mission": 200, "airframe": 150, "scenario": 150, "plant": 150, "flag": 200, "fault_line": 200}
INPUTS |= {"vehicle": 1000, "link": 1500, "pilot": 200}


@pytest.mark.parametrize("name", list(TARGETS))
def test_whatever_comes_is_taken_or_refused_with_a_reason(name: str) -> None:
    """No crash, no hang, no traceback, no number that is none."""
    tally = run([name], INPUTS[name], SEED, processes=1)[name]
    assert not tally.findings, _told(tally)
    assert tally.inputs == INPUTS[name]
    assert tally.accepted > 0
    assert tally.refused > 0


def test_an_input_can_be_repeated() -> None:
    """By target, seed and index alone, also where inputs share a session."""
    whole = run(["vehicle"], 40, SEED, processes=1)["vehicle"]
    part = run(["vehicle"], 0, SEED, processes=1, repeat=39)["vehicle"]
    assert (whole.inputs, whole.accepted, whole.refused) == (part.inputs, part.accepted, part.refused)


def test_a_live_link_and_a_live_vehicle_outlive_what_is_thrown_at_them() -> None:
    """Real sockets, real MAVSDK: afterwards both still talk, and nothing has gone to the terminal."""
    result = bombard(SEED, 1000)
    assert result.exit_code == 0, result.problem
    assert result.problem == ""
    assert result.samples > 100
    assert result.fresh > 20
    assert result.vehicle_alive


def _told(tally: Tally) -> str:
    return "\n".join(f"--target {f.target} --seed {f.seed} --repeat {f.index}\n{f.text}" for f in tally.findings)
