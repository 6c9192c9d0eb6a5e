"""The preflight check inside the step: when it is made, what a stop does, and what it does not do to a pilot."""

from __future__ import annotations

from typing import Any

import pytest

from tests.flight.preflight.gathering import CHARGED, facts, health
from tests.flight.test_pilot import PERIOD_S, Flight
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.flight.preflight.preflight import FACTS_PATIENCE_S
from uasfly.messages import FactsSample, Phase, RequestKind
from uasfly.preflight_messages import Verdict


class CheckedFlight(Flight):
    """A flight with a preflight check, whose driver hands in its facts after a while."""

    def __init__(
        self, told: FactsSample | None, engage: Engage = Engage.AUTO, *, only_check: bool = False, after_s: float = 0.5
    ) -> None:
        super().__init__(engage=engage)
        before = self.pilot
        self.pilot = Pilot(
            before.airframe,
            before.mission,
            before.observer,
            before.controller,
            engage,
            preflight=True,
            only_check=only_check,
        )
        self._told, self._told_at_s = told, self.time_s + after_s

    def step(self) -> StepResult:
        """One cycle."""
        self._queue += [CHARGED, health()]
        if self._told is not None and self.time_s >= self._told_at_s:
            self._queue.append(self._told)
            self._told = None
        return super().step()

    @property
    def judged(self) -> list[StepResult]:
        """The steps in which the checks were made."""
        return [step for step in self.steps if step.preflight]


STOPS: dict[str, Any] = {"parameters": {"COM_OBL_RC_ACT": 7.0}}


def test_a_flight_with_which_all_is_well_is_judged_once_and_flies() -> None:
    """As soon as it is ready: the take-off comes no more than two cycles later than without the check."""
    checked, plain = CheckedFlight(facts()), Flight()
    checked.until(Phase.TAKEOFF)
    plain.until(Phase.TAKEOFF)
    assert checked.time_s - plain.time_s <= 2.0 * PERIOD_S + 1e-9
    checked.until(Phase.DONE)
    (step,) = checked.judged
    assert {check.verdict for check in step.preflight} == {Verdict.OK}
    assert not [text for text in checked.texts if "preflight " in text and "phase" not in text]


def test_a_flight_waits_for_its_facts() -> None:
    """Nothing is armed before the parameters are known."""
    flight = CheckedFlight(facts(), after_s=2.5)
    flight.run(2.4)
    assert (flight.phase, flight.asked) == (Phase.PREFLIGHT, [])
    flight.run(0.2)
    assert flight.phase is Phase.TAKEOFF


def test_facts_that_never_come_are_not_waited_for_for_long() -> None:
    """What they would have told is a warning each, and it flies."""
    flight = CheckedFlight(None)
    flight.until(Phase.TAKEOFF)
    assert flight.time_s - 50.0 <= 1.0 + FACTS_PATIENCE_S + 0.2
    (step,) = flight.judged
    unknown = {check.name for check in step.preflight if check.verdict is Verdict.WARNING}
    assert {"COM_OBL_RC_ACT", "solver", "home", "round trip"} <= unknown


def test_a_stop_arms_nothing_and_tells_why() -> None:
    """Aborted; the reason names the check, and the announcement what to do."""
    flight = CheckedFlight(facts(**STOPS))
    result = flight.until(Phase.ABORTED)
    assert flight.asked == []
    assert flight.pilot.done
    assert result.status.reason == "the preflight check says stop: COM_OBL_RC_ACT: 7 (disarm): the vehicle falls"
    assert (3, "preflight stop: COM_OBL_RC_ACT 7 (disarm): the vehicle falls: set it to 5 (hold) or 4 (land)") in (
        result.status.announcements
    )
    assert result.setpoint is None


def test_a_stop_keeps_a_pilot_on_the_ground_too() -> None:
    """A take-off that would not be followed is not waited for."""
    flight = CheckedFlight(facts(**STOPS), Engage.PILOT)
    flight.until(Phase.ABORTED)
    assert flight.asked == []


def test_a_pilot_who_flies_already_is_warned() -> None:
    """A stop is announced as a warning that says what it would have been, and the flight goes on."""
    flight = CheckedFlight(facts(**STOPS), Engage.PILOT)
    flight.armed = flight.in_air = True
    flight.until(Phase.ENGAGE)
    (step,) = flight.judged
    assert Verdict.STOP not in {check.verdict for check in step.preflight}
    assert any("on the ground this would be a stop" in text for text in flight.texts)


def test_a_vehicle_met_in_the_air_is_not_taken_by_uasfly_itself() -> None:
    """With --engage auto it is uasfly that would take it: a stop leaves it to whoever has it."""
    flight = CheckedFlight(facts(**STOPS))
    flight.armed = flight.in_air = True
    flight.until(Phase.ABORTED)
    assert flight.asked == []
    assert not flight.pilot.sequencer.hand_over


@pytest.mark.parametrize("in_air", [False, True])
@pytest.mark.parametrize("engage", list(Engage))
def test_a_mere_check_is_done_without_a_request(engage: Engage, in_air: bool) -> None:
    """Whoever flies; a stop stays one."""
    for told, phase in ((facts(), Phase.DONE), (facts(**STOPS), Phase.ABORTED)):
        flight = CheckedFlight(told, engage, only_check=True)
        flight.armed = flight.in_air = in_air
        flight.until(phase)
        assert flight.asked == []
        (step,) = flight.judged
        assert (Verdict.STOP in {check.verdict for check in step.preflight}) == (phase is Phase.ABORTED)


def test_a_vehicle_that_does_not_get_ready_is_judged_in_its_last_step() -> None:
    """No odometry: the list tells what is known, without waiting for facts."""
    flight = CheckedFlight(None)
    flight.observer.blind = True
    result = flight.until(Phase.ABORTED)
    assert "no ODOMETRY" in result.status.reason
    by_name = {check.name: check for check in result.preflight}
    assert by_name["estimate"].verdict is Verdict.STOP
    assert by_name["battery"].verdict is Verdict.OK


def test_a_second_flight_of_the_pilot_is_judged_again() -> None:
    """With the facts of the first and what telemetry says now."""
    flight = CheckedFlight(facts(), Engage.PILOT)
    flight.armed = flight.in_air = True
    flight.until(Phase.ENGAGE)
    flight.armed = flight.in_air = False
    flight.until(Phase.PREFLIGHT)
    flight.run(1.5)
    assert len(flight.judged) == 2
    assert RequestKind.ARM not in flight.asked
