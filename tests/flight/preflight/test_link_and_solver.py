"""Rates, latency, losses and the solver, each way."""

from __future__ import annotations

import math

import pytest

from tests.flight.preflight.gathering import AIRFRAME, OK, STOP, WARNING, check, facts, verdict
from uasfly.messages import NamedValue
from uasfly.preflight_messages import Verdict


@pytest.mark.parametrize(("rate_hz", "expected"), [(99.0, OK), (46.0, OK), (30.0, WARNING), (9.0, STOP), (0.0, STOP)])
def test_odometry_is_as_fast_as_the_controller(rate_hz: float, expected: Verdict) -> None:
    """Slower is a warning; as slow that one lost sample is a silence, a stop."""
    assert verdict("odometry rate", facts=facts(rates_hz=(NamedValue("ODOMETRY", rate_hz),))) is expected


@pytest.mark.parametrize(("rate_hz", "expected"), [(49.0, OK), (10.0, OK), (1.0, WARNING)])
def test_attitude_targets_come(rate_hz: float, expected: Verdict) -> None:
    """Without them the switch to offboard may bump, which is no reason to stay on the ground."""
    assert verdict("target rate", facts=facts(rates_hz=(NamedValue("ATTITUDE_TARGET", rate_hz),))) is expected


@pytest.mark.parametrize(
    ("ages_s", "expected"),
    [
        ((0.005,) * 100, OK),
        ((0.005,) * 97 + (5.0,) * 3, OK),
        ((0.12,) * 100, WARNING),
        ((0.3,) * 100, STOP),
        ((math.inf,) * 10 + (0.01,) * 10, OK),
        ((math.inf,) * 10, WARNING),
        ((), WARNING),
    ],
)
def test_samples_are_young(ages_s: tuple[float, ...], expected: Verdict) -> None:
    """95 % of them count, against the age at which setpoints stop."""
    assert verdict("latency", ages_s=ages_s) is expected


@pytest.mark.parametrize(
    ("round_trip_s", "expected"), [(0.7e-3, OK), (0.08, WARNING), (0.3, STOP), (math.nan, WARNING)]
)
def test_the_round_trip_is_short(round_trip_s: float, expected: Verdict) -> None:
    """One that is not known is told."""
    assert verdict("round trip", facts=facts(round_trip_s=round_trip_s)) is expected


def test_losses_are_told() -> None:
    """By cause; those that did not happen are not."""
    lost = (NamedValue("ODOMETRY unusable", 3.0), NamedValue("send errors", 0.0))
    line = check("losses", facts=facts(losses=lost))
    assert (line.verdict, line.value) == (WARNING, "3 ODOMETRY unusable")
    assert check("losses").value == "none"


@pytest.mark.parametrize("name", ["odometry rate", "target rate", "round trip", "losses", "solver"])
def test_what_was_not_measured_is_a_warning(name: str) -> None:
    """Never ok."""
    assert verdict(name, facts=None) is WARNING


PERIOD_MS = 1e3 / AIRFRAME.controller.rate_hz


@pytest.mark.parametrize(
    ("solve_ms", "expected"),
    [
        ((0.01 * PERIOD_MS,) * 200, OK),
        ((0.01 * PERIOD_MS,) * 198 + (2.0 * PERIOD_MS,) * 2, OK),
        ((0.01 * PERIOD_MS,) * 190 + (0.9 * PERIOD_MS,) * 10, WARNING),
        ((0.5 * PERIOD_MS,) * 200, WARNING),
        ((0.9 * PERIOD_MS,) * 150 + (0.1 * PERIOD_MS,) * 50, STOP),
    ],
)
def test_the_solver_keeps_up(solve_ms: tuple[float, ...], expected: Verdict) -> None:
    """Against the period: a busy moment is no matter, half of it is a warning, late half of the time a stop."""
    line = check("solver", facts=facts(solve_ms=solve_ms))
    assert line.verdict is expected
    assert f"of a period of {PERIOD_MS:.0f} ms" in line.value


def test_pids_need_no_solver() -> None:
    """Nothing was measured because there is nothing."""
    assert check("solver", facts=facts(solve_ms=())).value == "none, the PIDs fly"
