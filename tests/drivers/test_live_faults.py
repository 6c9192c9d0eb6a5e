"""The live loop when something breaks: no more setpoints, hold asked for, log closed, and one text that says what."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.flight.test_pilot import FakeController, FakeObserver
from uasfly.control.protocol import ControlResult, ReferenceAt
from uasfly.drivers.live import fly
from uasfly.drivers.plan import FlightPlan, load_plan
from uasfly.drivers.watching import BACKLOG, BackgroundWatch, Cycle
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.messages import (
    FlightMode,
    OdometrySample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    Sample,
    Setpoint,
    StateEstimate,
    Status,
    VehicleSample,
)
from uasfly.record.reader import LogReader
from uasfly.wind_messages import WindEstimate

CYCLES = 20  # in the legs, before something happens


class HoveringLink:
    """A vehicle that hovers where it is met and accepts everything.

    In the legs `fault` breaks that call, or `signals` reach this process.
    """

    def __init__(self, fault: str) -> None:
        self.fault = fault
        self.signals: list[signal.Signals] = []
        self.mode = FlightMode.HOLD
        self.asked: list[RequestKind] = []
        self.setpoints_in_offboard = 0
        self.winds: list[WindEstimate] = []
        self._answers: list[Sample] = []

    def poll(self) -> tuple[Sample, ...]:
        """Telemetry of now, and answers."""
        if self.fault == "poll" and self._breaks():
            raise KeyError("fields")
        now = asyncio.get_running_loop().time()
        level, zero = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
        answers, self._answers = self._answers, []
        return (OdometrySample(now, zero, zero, level, zero), VehicleSample(now, self.mode, True, True), *answers)

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """None comes by itself: it is there whenever somebody looks."""
        await asyncio.sleep(timeout_s)
        return False

    def send_text(self, severity: int, text: str) -> None:
        """Nobody listens."""

    def send_wind(self, wind: WindEstimate) -> None:
        """Keep it."""
        self.winds.append(wind)

    def send(self, setpoint: Setpoint) -> bool:
        """Count."""
        if self.fault == "send" and self._breaks():
            raise ValueError("a setpoint must be finite")
        self.setpoints_in_offboard += self.mode is FlightMode.OFFBOARD
        while self.signals and self._breaks():
            os.kill(os.getpid(), self.signals.pop())
        return True

    def request(self, request: Request) -> None:
        """Obey."""
        self.asked.append(request.kind)
        self.mode = {RequestKind.OFFBOARD: FlightMode.OFFBOARD}.get(request.kind, FlightMode.HOLD)
        self._answers.append(RequestResult(0.0, request, accepted=True))

    def _breaks(self) -> bool:
        return self.setpoints_in_offboard >= CYCLES


class BreakingController(FakeController):
    """Raises after some steps in offboard, where it is told to."""

    link: HoveringLink | None = None

    def step(
        self, time_s: float, estimate: StateEstimate, reference_at: ReferenceAt, battery_voltage_v: float | None
    ) -> ControlResult:
        """Hold still, or break."""
        link = self.link
        if link is not None and link.fault == "step" and link.setpoints_in_offboard >= CYCLES:
            raise ZeroDivisionError("a bug")
        return super().step(time_s, estimate, reference_at, battery_voltage_v)


class CountedObserver(FakeObserver):
    """With the counters that the summary reads."""

    class counters:  # noqa: N801 - an attribute of the observer
        rejected: dict[str, int] = {}  # noqa: RUF012


def _prepare(fault: str) -> tuple[FlightPlan, Pilot, HoveringLink]:
    plan = load_plan("hover", "f550", settings=["mission.ending.action=hold"])
    link, controller, observer = HoveringLink(fault), BreakingController(), CountedObserver()
    controller.link = link
    observer.position = np.array([0.0, 0.0, 1.5])
    return plan, Pilot(plan.airframe, plan.mission, observer, controller, Engage.AUTO), link  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("poll", "internal error: KeyError: 'fields' in test_live_faults.py"),
        ("send", "internal error: ValueError: a setpoint must be finite"),
        ("step", "internal error: ZeroDivisionError: a bug"),
    ],
)
async def test_an_error_in_a_cycle_ends_the_flight_in_hold(
    fault: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not one setpoint after it; hold is the last request; log and live view end with the reason; no traceback."""
    monkeypatch.delenv("UASFLY_DEBUG", raising=False)
    plan, pilot, link = _prepare(fault)
    seen: list[Status] = []
    summary = await fly(plan, pilot, link, tmp_path / "flight.mcap", lambda status, _: seen.append(status))
    assert summary["outcome"] == "aborted"
    assert summary["reason"].startswith(told)
    assert link.setpoints_in_offboard == CYCLES
    assert link.asked == [RequestKind.OFFBOARD, RequestKind.HOLD]
    reader = LogReader(tmp_path / "flight.mcap")
    logged = [entry.message for entry in reader.messages() if isinstance(entry.message, Status)]
    assert reader.complete
    assert [status.reason for status in (logged[-1], seen[-1])] == [summary["reason"]] * 2
    assert logged[-1].phase is Phase.ABORTED
    assert capsys.readouterr().err == ""


async def test_the_traceback_is_there_for_those_who_want_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """UASFLY_DEBUG shows where the error came from."""
    monkeypatch.setenv("UASFLY_DEBUG", "1")
    plan, pilot, link = _prepare("step")
    await fly(plan, pilot, link)
    error = capsys.readouterr().err
    assert "Traceback" in error
    assert "ZeroDivisionError: a bug" in error


async def test_a_live_view_that_breaks_does_not_end_the_flight() -> None:
    """A closed terminal: the flight ends in order, and the summary says that the view stopped long before."""
    plan, pilot, link = _prepare("")
    link.signals = [signal.SIGHUP]

    def watch(status: Status, cycle: Cycle) -> None:
        raise OSError(5, "Input/output error")

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    summary = await fly(plan, pilot, link, None, watch)
    assert summary["reason"] == "terminal closed"
    assert link.asked == [RequestKind.OFFBOARD, RequestKind.HOLD]
    assert any("live view stopped" in warning for warning in summary["warnings"])
    assert {number: signal.getsignal(number) for number in before} == before


async def test_two_signals_hand_over_at_once() -> None:
    """Ctrl-C and a termination in the same moment: the driver asks for hold, once, and nothing is streamed after."""
    plan, pilot, link = _prepare("")
    link.signals = [signal.SIGINT, signal.SIGTERM]
    summary = await fly(plan, pilot, link)
    assert summary["outcome"] == "aborted"
    assert link.asked == [RequestKind.OFFBOARD, RequestKind.HOLD]
    assert link.setpoints_in_offboard <= CYCLES + 1


def test_a_terminal_that_takes_nothing_costs_neither_time_nor_memory() -> None:
    """Steps beyond the backlog are dropped, except those that announce something; closing does not wait for it."""
    stuck, taken = threading.Event(), []

    def watch(status: Status, cycle: Cycle) -> None:
        taken.append(status)
        stuck.wait(30.0)

    view = BackgroundWatch(watch)
    for k in range(10 * BACKLOG):
        texts: Any = ((4, "gust"),) if k == 10 * BACKLOG - 1 else ()
        view(
            Status(0.02 * k, Phase.LEGS, 0, True, 0.5, None, None, announcements=texts),
            Cycle(sent=True, cycle_ms=1.0, solve_ms=None),
        )
    stuck.set()
    view.close()
    assert len(taken) <= BACKLOG + 3
    assert taken[-1].announcements == ((4, "gust"),)
