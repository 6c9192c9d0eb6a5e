"""The fault table flown: each fault ends as expected, and no senseless or stale setpoint leaves in any of them."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest
from typer.testing import CliRunner

from uasfly.cli.main import app
from uasfly.drivers.faults.case import FaultCase
from uasfly.drivers.faults.catalogue import CATALOGUE
from uasfly.drivers.faults.live import without_one_under_way
from uasfly.drivers.faults.outcome import Outcome, bad_setpoints, judge, sentence
from uasfly.drivers.faults.story import Story
from uasfly.drivers.faults.table import fly_table, select_cases
from uasfly.errors import UasflyError
from uasfly.messages import Action, Phase, Request, RequestKind, Setpoint, Status

SEED = 1
FEWEST = 25
LIMITS = (0.5, 0.1, 0.65)


@pytest.fixture(scope="module")
def outcomes() -> dict[str, Outcome]:
    """Every fault of the catalogue, flown once."""
    return {outcome.case.name: outcome for outcome in fly_table(list(CATALOGUE), SEED, lambda _: None)}


@pytest.mark.parametrize("case", CATALOGUE, ids=lambda case: case.name)
def test_a_fault_ends_as_expected(case: FaultCase, outcomes: dict[str, Outcome]) -> None:
    """Words, reaction and distance as the catalogue says; every setpoint finite, in range and younger than 0.2 s."""
    outcome = outcomes[case.name]
    assert outcome.as_expected, (sentence(outcome.observed), outcome.problems, outcome.texts)


def test_the_catalogue_is_complete() -> None:
    """At least 25 faults with different names, each with something expected."""
    names = [case.name for case in CATALOGUE]
    assert len(names) == len(set(names)) >= FEWEST
    assert all(case.expected for case in CATALOGUE)


def _status(time_s: float, phase: Phase, action: Action = Action.NOTHING) -> tuple[float, Status]:
    return time_s, Status(time_s, phase, 0, True, 0.5, None, None, action=action)


def _setpoint(time_s: float, made_s: float | None = None, **fields: float) -> Setpoint:
    values = {"roll_rad": 0.0, "pitch_rad": 0.0, "yaw_rad": 0.0, "yaw_rate_rad_s": 0.0, "thrust": 0.4, **fields}
    return Setpoint(time_s if made_s is None else made_s, **values)


def _flight(until_s: float, silent: Callable[[float], bool] = lambda _: False) -> list[tuple[float, object]]:
    messages: list[tuple[float, object]] = []
    for k in range(round(until_s / 0.02)):
        time_s = 0.02 * k
        if not silent(time_s):
            messages.append((time_s, _setpoint(time_s)))
        messages.append(_status(time_s, Phase.LEGS))
    return messages


def test_a_story_tells_silence_actions_and_the_end() -> None:
    """Setpoints that stop and come again, an action that grows and ends, a request, and the outcome, in order."""
    messages = _flight(3.0, silent=lambda time_s: 1.0 <= time_s < 2.0)
    messages += [_status(3.0, Phase.LEGS, Action.HOLD), _status(3.02, Phase.LEGS)]
    messages += [(3.04, Request(RequestKind.LAND)), _status(3.04, Phase.ENDING), _status(3.06, Phase.DONE)]
    story = Story()
    story.read(messages)
    assert story.from_fault(0.5) == ("silent", "streams", "hold", "flies on", "asks land", "completed")
    assert story.reaction_s(0.5) == pytest.approx(0.58, abs=0.03)


def test_a_story_tells_that_the_cycle_stood_still() -> None:
    """A gap of more than 0.2 s in the steps; what was before the fault is not told."""
    messages = [(time_s, message) for time_s, message in _flight(6.0) if not 2.0 < time_s < 5.0]
    story = Story()
    story.read(messages)
    assert story.from_fault(2.0) == ("stands still", "streams")
    assert story.from_fault(4.0) == ("streams",)


@pytest.mark.parametrize(
    ("age_s", "setpoint", "problem"),
    [
        (0.0, _setpoint(1.0, roll_rad=float("nan")), "not finite"),
        (0.0, _setpoint(1.0, thrust=0.9), "out of range"),
        (0.0, _setpoint(1.0, pitch_rad=-0.6), "out of range"),
        (0.3, _setpoint(1.0), "older"),
        (float("nan"), _setpoint(1.0), "older"),
    ],
)
def test_a_wrong_setpoint_is_found(age_s: float, setpoint: Setpoint, problem: str) -> None:
    """Each kind of what must never leave."""
    (text,) = bad_setpoints([(age_s, setpoint)], LIMITS)
    assert problem in text
    assert bad_setpoints([(0.1, _setpoint(1.0))], LIMITS) == []


def test_of_a_stopped_process_one_setpoint_may_have_been_under_way() -> None:
    """Only the first after the stop, and only where it was made in the cycle that was stopped: all others count."""
    stopped_s, for_s = 10.0, 3.0
    before = [(9.98, 0.002, _setpoint(9.978))]
    under_way = (13.001, 3.004, _setpoint(9.997))
    after = [(13.02, 0.002, _setpoint(13.018))]
    assert without_one_under_way([*before, under_way, *after], stopped_s, for_s) == before + after
    for wrong in (
        [*before, (13.001, 1.0, _setpoint(12.0)), *after],  # made when nobody was there to make it
        [*before, (13.001, 3.1, _setpoint(9.9)), *after],  # made long before
        [*before, *after, (13.03, 3.033, _setpoint(9.997))],  # not the first
        [*before, (11.0, 1.003, _setpoint(9.997)), *after],  # leaves while the process stands
    ):
        assert without_one_under_way(wrong, stopped_s, for_s) == wrong
    assert without_one_under_way([*before, under_way, under_way], stopped_s, for_s) == [*before, under_way]
    assert without_one_under_way(before, stopped_s, for_s) == before


def test_an_outcome_is_held_against_everything_expected() -> None:
    """Other words, a late reaction, and a flight that strays are problems of their own."""
    case = FaultCase("made up", "made up", ("hold",), stray_m=0.1, reaction_s=0.5)
    story = Story()
    story.read(_flight(1.0))
    outcome = judge(case, story, 0.5, LIMITS, [])
    assert not outcome.as_expected
    assert len(outcome.problems) == 2
    fine = FaultCase("made up", "made up", (), stray_m=0.1)
    assert judge(fine, story, 0.5, LIMITS, []).as_expected


def test_an_unknown_fault_is_refused_with_those_there_are() -> None:
    """The error lists the faults."""
    with pytest.raises(UasflyError, match="gnss_jump"):
        select_cases(["gnss_jmp"])


def test_the_command_prints_what_scripts_need() -> None:
    """One fault as JSON: a list of objects with the promised fields; exit code 0 when all is as expected."""
    result = CliRunner().invoke(app, ["faults", "arming_refused", "--json"])
    assert result.exit_code == 0
    (row,) = json.loads(result.stdout)
    assert {"fault", "expected", "observed", "as_expected", "reaction_s", "strayed_m"} <= set(row)
    assert row["as_expected"] is True
