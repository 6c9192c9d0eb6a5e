"""All checks together and what follows from them."""

from __future__ import annotations

from tests.flight.preflight.gathering import OK, STOP, WARNING, facts, gathered, view
from uasfly.flight.preflight import announcements, as_pilot_flies, judge, stop_reason


def test_a_vehicle_with_which_all_is_well_has_nothing_to_announce() -> None:
    """Every check is there once, and says ok."""
    checks = judge(gathered())
    names = [check.name for check in checks]
    assert len(names) == len(set(names)) >= 20
    assert {check.verdict for check in checks} == {OK}
    assert announcements(checks) == []
    assert stop_reason(checks) == ""


def test_stops_and_warnings_are_announced_with_what_to_do() -> None:
    """A stop as an error, a warning as a warning; only stops are a reason to stay."""
    checks = judge(gathered(view=view(velocity_ok=False), facts=facts({"COM_OF_LOSS_T": 3.0})))
    told = dict(announcements(checks))
    assert set(told) == {3, 4}
    assert told[4] == "preflight warning: COM_OF_LOSS_T 3 s: set it to 1 s"
    assert told[3].startswith("preflight stop: ")
    reason = stop_reason(checks)
    assert reason.startswith("the preflight check says stop: health: no valid velocity; estimate: ")
    assert "COM_OF_LOSS_T" not in reason


def test_nothing_can_be_kept_on_the_ground_that_flies_already() -> None:
    """Stops become warnings that say so; the rest stays as it is."""
    checks = judge(gathered(view=view(velocity_ok=False)))
    softened = as_pilot_flies(checks)
    assert stop_reason(softened) == ""
    for before, after in zip(checks, softened, strict=True):
        if before.verdict is STOP:
            assert after.verdict is WARNING
            assert after.value == f"{before.value} (on the ground this would be a stop)"
        else:
            assert after == before


def test_a_vehicle_of_which_nothing_is_known_is_judged_all_the_same() -> None:
    """Nothing raises, nothing is ok, and it is not flown."""
    nothing = {"estimate": None, "diagnosis": None, "origin": None, "ages_s": (), "facts": None}
    checks = judge(gathered(view=type(view())(), **nothing))
    assert OK not in {check.verdict for check in checks}
    assert stop_reason(checks) == "the preflight check says stop: estimate: no estimate"
