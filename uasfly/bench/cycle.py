"""The whole cycle's times, measured in a flight: the live driver over MAVSDK with the simulated vehicle on loopback."""

from __future__ import annotations

import asyncio
import selectors
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from uasfly.bench.link import CONNECT_TIMEOUT_S, SYSTEM_ID
from uasfly.bench.timing import Figures
from uasfly.drivers.flight import SWITCH_INTERVAL_S
from uasfly.drivers.live import fly
from uasfly.drivers.plan import FlightPlan, build_pilot
from uasfly.drivers.preflight import gather_facts, time_solver
from uasfly.drivers.watching import Cycle
from uasfly.errors import UasflyError
from uasfly.flight.choices import Engage
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port
from uasfly.messages import Phase, Sample, Setpoint, Status
from uasfly.sim.mavlink.process import start_process


@dataclass(frozen=True, slots=True)
class CycleFigures:
    """What a flight took.

    Attributes:
        cycle: from the cycle's first look for samples to the event loop's next sleep [ms]: decoding, observer,
            controller, monitors, the setpoint sent, the record handed to the log, the status to the view.
        solver: the solver in it [ms].
        to_setpoint: the part of the same cycles up to the setpoint, as a flight's summary counts them [ms].
        motion_to_setpoint: from when the newest motion was true to the setpoint that answers it [ms].
    """

    cycle: Figures
    solver: Figures
    to_setpoint: Figures
    motion_to_setpoint: dict[str, float] | None

    @property
    def rest_p99_ms(self) -> float:
        """p99 of a cycle less the solver's usual share of it [ms]."""
        return max(0.0, self.cycle.p99 - self.solver.median)


@dataclass(slots=True)
class Watcher:
    """Counts the cycles that sent a setpoint on the way, and ends the flight when there are enough."""

    wanted: int
    told: Callable[[float], None]
    end: Callable[[], None] = lambda: None
    flying: bool = False
    cycles_ms: list[float] = field(default_factory=list)
    solves_ms: list[float] = field(default_factory=list)
    to_setpoints_ms: list[float] = field(default_factory=list)

    def watch(self, status: Status, cycle: Cycle) -> None:
        """Called by the driver's view thread after each cycle."""
        self.flying = status.phase is Phase.LEGS
        if self.flying and cycle.sent and cycle.solve_ms is not None:
            self.solves_ms.append(cycle.solve_ms)
            self.to_setpoints_ms.append(cycle.cycle_ms)
            if len(self.solves_ms) % 50 == 0:
                self.told(min(1.0, len(self.solves_ms) / self.wanted))

    def measured(self, cycle_ms: float) -> None:
        """A cycle that sent a setpoint took so long."""
        if self.flying:
            self.cycles_ms.append(cycle_ms)
            if len(self.cycles_ms) == self.wanted:
                self.end()


class TimedLink(MavsdkLink):
    """The real link, which measures each cycle that sends a setpoint: from `poll` until the event loop sleeps."""

    watcher: Watcher
    _begun_s: float | None = None
    _sent = False

    def poll(self) -> tuple[Sample, ...]:
        """See `MavsdkLink.poll`; the cycle begins here."""
        if self._begun_s is None:
            self._begun_s, self._sent = time.perf_counter(), False
        return super().poll()

    def send(self, setpoint: Setpoint) -> bool:
        """See `MavsdkLink.send`."""
        self._sent = super().send(setpoint)
        return self._sent

    def sleeps(self) -> None:
        """The event loop has nothing left to do: the cycle ends here."""
        if self._begun_s is not None:
            elapsed_s, self._begun_s = time.perf_counter() - self._begun_s, None
            if self._sent:
                self.watcher.measured(1e3 * elapsed_s)


class _Bed(selectors.DefaultSelector):
    """Where the event loop sleeps; tells before it does."""

    link: TimedLink | None = None

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """See `BaseSelector.select`."""
        if self.link is not None:
            self.link.sleeps()
        return super().select(timeout)


def measure_cycle(plan: FlightPlan, cycles: int, told: Callable[[float], None]) -> CycleFigures:
    """Fly a plan, with a log as always, until so many cycles have been flown on the way; then hand over.

    Raises:
        UasflyError: the flight ended before that; the text says why.
    """
    assert plan.plant is not None
    assert plan.scenario is not None
    watcher, port = Watcher(cycles, told), free_udp_port()
    switch_interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    try:
        with (
            tempfile.TemporaryDirectory(prefix="uasfly-bench-") as folder,
            start_process(plan.plant, plan.scenario, plan.seed, remote_port=port, local_port=0),
        ):
            log = Path(folder) / "flight.mcap"
            bed = _Bed()
            with asyncio.Runner(loop_factory=lambda: asyncio.SelectorEventLoop(bed)) as runner:
                summary = runner.run(_fly(plan, f"udpin://127.0.0.1:{port}", log, watcher, bed))
    finally:
        sys.setswitchinterval(switch_interval)
    cycle, solver = Figures.of(watcher.cycles_ms), Figures.of(watcher.solves_ms)
    to_setpoint = Figures.of(watcher.to_setpoints_ms)
    if len(watcher.cycles_ms) < cycles or cycle is None or solver is None or to_setpoint is None:
        raise UasflyError(f"the flight ended before enough of it was measured: {summary['reason'] or 'it was short'}")
    return CycleFigures(cycle, solver, to_setpoint, summary["latency_ms"])


async def _fly(plan: FlightPlan, url: str, log: Path, watcher: Watcher, bed: _Bed) -> dict[str, Any]:
    pilot = build_pilot(plan, Engage.AUTO, time.perf_counter, late_counts=True, preflight=True)
    solve_ms = time_solver(plan)

    def end() -> None:
        for _ in range(2):  # the second one hands over at once
            pilot.interrupt(time.monotonic(), "enough has been measured")

    watcher.end = end
    link = await TimedLink.connect(url, system_id=SYSTEM_ID, timeout_s=CONNECT_TIMEOUT_S, want_truth=False)
    assert isinstance(link, TimedLink)
    link.watcher, bed.link = watcher, link
    try:
        return await fly(plan, pilot, link, log, watcher.watch, partial(gather_facts, link, solve_ms))
    finally:
        await link.close()
