"""Flies a mission over MAVSDK in real time: an asyncio loop around the pure step."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from uasfly.drivers.plan import FlightPlan, build_pilot
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.flight.sequencer import Engage
from uasfly.flight.summary import SummaryCollector
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.messages import Request, RequestKind, Sample, Status
from uasfly.record.writer import BackgroundLogWriter

HAND_OVER_S = 0.5  # time for the last request to leave and be answered


async def fly(
    plan: FlightPlan,
    link: MavsdkLink,
    engage: Engage,
    log: Path | None = None,
    watch: Callable[[Status, float | None], None] | None = None,
) -> dict[str, Any]:
    """Fly a plan over an open link and return its summary; the link is left open for its owner.

    SIGINT, SIGTERM and SIGHUP end the mission: the first holds and goes on to the mission's ending, the second hands
    over at once.

    Args:
        plan: what to fly.
        link: the connected vehicle.
        engage: who arms, takes off and switches to offboard.
        log: file for the flight log, None for none.
        watch: called with each step's status and the solve time [ms] (None where nothing was solved).

    Raises:
        FileError: when the log cannot be opened.
    """
    pilot = build_pilot(plan, engage, time.perf_counter)
    summary = SummaryCollector()
    writer = BackgroundLogWriter(log, plan.description()) if log is not None else None
    started = time.monotonic()
    gc.collect()
    gc.freeze()  # what lives now lives to the end: no need to look through it in flight
    try:
        with _signals(pilot):
            await _cycles(plan, pilot, link, summary, writer, watch)
        if pilot.sequencer.hand_over:
            link.request(Request(RequestKind.HOLD))
            await asyncio.sleep(HAND_OVER_S)
    finally:
        gc.unfreeze()
        if writer is not None:
            writer.close()
            if writer.problem:
                summary.warn(writer.problem)
    wall_s = time.monotonic() - started
    return summary.result(wall_s=wall_s, rejected=pilot.observer.counters.rejected, **plan.identity())


async def _cycles(
    plan: FlightPlan,
    pilot: Pilot,
    link: MavsdkLink,
    summary: SummaryCollector,
    writer: BackgroundLogWriter | None,
    watch: Callable[[Status, float | None], None] | None,
) -> None:
    period_s = 1.0 / plan.airframe.controller.rate_hz
    deadline = time.monotonic()
    log_lost = False
    while not pilot.done:
        deadline += period_s
        now = time.monotonic()
        if now > deadline + period_s:  # a cycle was missed: go on from here instead of hurrying after it
            deadline = now
        await asyncio.sleep(max(0.0, deadline - now))
        begun = time.monotonic()
        samples = link.poll()
        result = pilot.step(begun, samples)
        if result.setpoint is not None:
            link.send(result.setpoint)
            summary.setpoint_sent(time.monotonic())
        for request in result.requests:
            link.request(request)
        cycle_ms = (time.monotonic() - begun) * 1e3
        if writer is not None and writer.problem and not log_lost:
            log_lost = True
            pilot.announce(3, writer.problem)
        _account(summary, writer, result, samples, cycle_ms)
        if watch is not None:
            watch(result.status, None if result.control is None else result.control.solve_ms)


def _account(
    summary: SummaryCollector,
    writer: BackgroundLogWriter | None,
    result: StepResult,
    samples: tuple[Sample, ...],
    cycle_ms: float,
) -> None:
    summary.timed(None if result.control is None else result.control.solve_ms, cycle_ms)
    summary.cycle(result.status, samples)
    if writer is not None:
        for message in (*samples, *result.requests, result.setpoint, result.status):
            if message is not None:
                writer.write(message, result.status.time_s)


@contextlib.contextmanager
def _signals(pilot: Pilot) -> Any:
    """Route SIGINT, SIGTERM and SIGHUP to the pilot while a flight goes on."""
    loop = asyncio.get_running_loop()
    texts = {signal.SIGINT: "stopped by Ctrl-C", signal.SIGTERM: "told to terminate", signal.SIGHUP: "terminal closed"}
    for number, text in texts.items():
        loop.add_signal_handler(number, _interrupt, pilot, text)
    try:
        yield
    finally:
        for number in texts:
            loop.remove_signal_handler(number)


def _interrupt(pilot: Pilot, text: str) -> None:
    pilot.interrupt(time.monotonic(), text)
