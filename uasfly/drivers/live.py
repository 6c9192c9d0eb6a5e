"""Flies a mission over MAVSDK in real time: an asyncio loop around the pure step."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import math
import signal
import time
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from typing import Any

from uasfly.drivers.live_eyes import LiveEyes
from uasfly.drivers.metronome import Metronome
from uasfly.drivers.plan import FlightPlan
from uasfly.drivers.sight import TrueMarkers
from uasfly.drivers.watching import BackgroundWatch, Cycle, Watch
from uasfly.errors import describe_error
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.flight.summary import SummaryCollector
from uasfly.link.protocol import LiveLink
from uasfly.messages import (
    FactsSample,
    MarkerSample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    Sample,
    Setpoint,
    Status,
)
from uasfly.record.writer import BackgroundLogWriter

HAND_OVER_S = 2.5  # time for the last request to be repeated and answered
HAND_OVER_POLL_S = 0.05
WIND_INTERVAL_S = 1.0  # between two winds told to the ground station
TOLD_SEVERITY = 5  # and worse: notice, warning, error ...


async def fly(
    plan: FlightPlan,
    pilot: Pilot,
    link: LiveLink,
    log: Path | None = None,
    watch: Watch | None = None,
    gather: Callable[[], Coroutine[Any, Any, FactsSample]] | None = None,
    eyes: LiveEyes | None = None,
) -> dict[str, Any]:
    """Fly a plan over an open link and return its summary; the link is left open for its owner.

    SIGINT, SIGTERM and SIGHUP end the mission: the first holds and goes on to the mission's ending, the second hands
    over at once. An unexpected error ends the flight too: nothing more is streamed, the vehicle is asked to hold, the
    log is closed, and the summary's reason tells the error.

    Args:
        plan: what to fly.
        pilot: made for this plan (`build_pilot`).
        link: the connected vehicle.
        log: file for the flight log, None for none.
        watch: called in a thread of its own with each step's status and what the driver knows of the cycle.
        gather: finds out what the preflight check wants to know, beside the cycles.
        eyes: look for bundles beside the cycles; they are left open for their owner.

    Raises:
        FileError: when the log cannot be opened.
    """
    writer = BackgroundLogWriter(log, plan.description()) if log is not None else None
    watching = BackgroundWatch(watch) if watch is not None else None
    flight = _LiveFlight(pilot, link, writer, watching, eyes, TrueMarkers(plan.sight))
    facts = None if gather is None else asyncio.create_task(gather())
    started = time.monotonic()
    gc.collect()
    gc.freeze()  # what lives now lives to the end: no need to look through it in flight
    with _signals(pilot):
        try:
            await flight.run(1.0 / plan.airframe.controller.rate_hz, facts)
        finally:
            if facts is not None:
                facts.cancel()
            gc.unfreeze()
            flight.close()
    wall_s = time.monotonic() - started
    return flight.summary.result(wall_s=wall_s, rejected=pilot.observer.counters.rejected, **plan.identity())


class _LiveFlight:
    """One flight with those who listen to it: summary, log and live view."""

    def __init__(
        self,
        pilot: Pilot,
        link: LiveLink,
        writer: BackgroundLogWriter | None,
        watch: BackgroundWatch | None,
        eyes: LiveEyes | None,
        true_markers: TrueMarkers,
    ) -> None:
        self.summary = SummaryCollector()
        self._pilot = pilot
        self._link = link
        self._writer = writer
        self._watch = watch
        self._eyes = eyes
        self._true_markers = true_markers
        self._log_lost = False
        self._wind_due_s = -math.inf
        self._facts: asyncio.Task[FactsSample] | None = None

    async def run(self, period_s: float, facts: asyncio.Task[FactsSample] | None) -> None:
        """Cycle until the flight has ended, and leave a vehicle that still flies in hold."""
        self._facts = facts
        try:
            await self._cycles(period_s)
        except Exception as error:
            self._break_off(describe_error(error))
        if self._pilot.sequencer.hand_over:
            await self._hand_over()

    def close(self) -> None:
        """Close log and view; what went wrong with them is in the summary."""
        if self._writer is not None:
            self._writer.close()
            if self._writer.problem:
                self.summary.warn(self._writer.problem)
        if self._watch is not None:
            self._watch.close()
            if self._watch.problem:
                self.summary.warn(self._watch.problem)

    async def _cycles(self, period_s: float) -> None:
        metronome = Metronome(self._link, period_s)
        while not self._pilot.done:
            await metronome.next()
            self._cycle()

    def _cycle(self) -> None:
        begun = time.monotonic()
        samples = self._link.poll() + self._gathered() + self._sighted()
        result = self._pilot.step(begun, samples)
        sent = result.setpoint is not None and self._send(result.setpoint)
        for request in result.requests:
            self._link.request(request)
        if self._eyes is not None:
            self._eyes.expect(begun, self._pilot.observer)
        cycle_ms = (time.monotonic() - begun) * 1e3
        if self._writer is not None and self._writer.problem and not self._log_lost:
            self._log_lost = True
            self._pilot.announce(3, self._writer.problem)
        solve_ms = None if result.control is None else result.control.solve_ms
        self.summary.timed(solve_ms, cycle_ms)
        self.summary.cycle(result.status, samples, self._true_markers.datum(self._pilot.observer))
        self.summary.preflight(result.preflight)
        self._tell_ground(result.status)
        self._record(result, samples)
        if self._watch is not None:
            self._watch(result.status, Cycle(sent, cycle_ms, solve_ms))

    def _gathered(self) -> tuple[FactsSample, ...]:
        """What the preflight check wants to know, once; after an error it judges without."""
        task = self._facts
        if task is None or not task.done():
            return ()
        self._facts = None
        error = task.exception()
        if error is None:
            return (task.result(),)
        self._pilot.announce(4, f"the preflight check knows less: {describe_error(error)}")
        return ()

    def _sighted(self) -> tuple[MarkerSample, ...]:
        """What has been seen since the last cycle; camera and detection tell the pilot what troubles them."""
        if self._eyes is None:
            return ()
        for severity, text in self._eyes.take_announcements():
            self._pilot.announce(severity, text)
        return self._eyes.look()

    def _send(self, setpoint: Setpoint) -> bool:
        """A setpoint that has become old on its way here (the process was stopped) does not leave."""
        sent = self._link.send(setpoint)
        if sent:
            motion = self._pilot.view.odometry
            self.summary.setpoint_sent(time.monotonic(), math.nan if motion is None else motion.time_s)
        else:
            self._pilot.announce(3, "a setpoint was too old to be sent: this computer or the process was stopped")
        return sent

    def _tell_ground(self, status: Status) -> None:
        """The ground station hears what the pilot at the screen does, but for the small talk."""
        for severity, text in status.announcements:
            if severity <= TOLD_SEVERITY:
                self._link.send_text(severity, f"uasfly: {text}")
        if status.wind is not None and status.time_s >= self._wind_due_s:
            self._wind_due_s = status.time_s + WIND_INTERVAL_S
            self._link.send_wind(status.wind)

    def _record(self, result: StepResult, samples: tuple[Sample, ...]) -> None:
        if self._writer is not None:
            messages = (*samples, *result.requests, result.setpoint, *result.preflight, result.status)
            self._writer.write_all(messages, result.status.time_s)

    def _break_off(self, reason: str) -> None:
        """End a flight whose cycle has failed; its step gives no status any more, so this one stands for it."""
        now = time.monotonic()
        self._pilot.leave(now, reason)
        texts = tuple(self._pilot.sequencer.announcements)
        status = Status(now, Phase.ABORTED, -1, False, 0.0, None, None, reason=reason, announcements=texts)
        if self._writer is not None:
            self._writer.write(status, now)
        if self._watch is not None:
            self._watch(status, Cycle(False, 0.0, None))
        self.summary.abort(status)

    async def _hand_over(self) -> None:
        """Ask for hold and wait for the answer: the link repeats the request only while this program runs."""
        request = Request(RequestKind.HOLD)
        problem = "the vehicle has not answered the last request, hold"
        try:
            self._link.request(request)
            for _ in range(round(HAND_OVER_S / HAND_OVER_POLL_S)):
                await asyncio.sleep(HAND_OVER_POLL_S)
                answer = self._answer_to(request)
                if answer is not None:
                    problem = "" if answer.accepted else f"the last request, hold, was refused: {answer.text}"
                    break
        except Exception as error:
            problem = f"hold could not be asked for: {describe_error(error)}"
        if problem:
            self.summary.warn(problem)

    def _answer_to(self, request: Request) -> RequestResult | None:
        try:
            samples = self._link.poll()
        except Exception:  # perhaps what has ended the flight; the request is on its way nevertheless
            return None
        answer = None
        for sample in samples:
            if self._writer is not None:
                self._writer.write(sample, time.monotonic())
            if isinstance(sample, RequestResult) and sample.request is request:
                answer = sample
        return answer


@contextlib.contextmanager
def _signals(pilot: Pilot) -> Iterator[None]:
    """Route SIGINT, SIGTERM and SIGHUP to the pilot; a SIGHUP that is ignored (nohup) stays so."""
    loop = asyncio.get_running_loop()
    texts = {signal.SIGINT: "stopped by Ctrl-C", signal.SIGTERM: "told to terminate", signal.SIGHUP: "terminal closed"}
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        del texts[signal.SIGHUP]
    before = {number: signal.getsignal(number) for number in texts}
    for number, text in texts.items():
        loop.add_signal_handler(number, _interrupt, pilot, text)
    try:
        yield
    finally:
        for number, handler in before.items():
            loop.remove_signal_handler(number)
            signal.signal(number, handler)


def _interrupt(pilot: Pilot, text: str) -> None:
    pilot.interrupt(time.monotonic(), text)
