"""A flight over MAVSDK from flags to summary: files, link, simulated vehicle where asked, and nothing left running."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from uasfly.drivers.checking import refuse_infeasible
from uasfly.drivers.live import fly
from uasfly.drivers.plan import FlightPlan, build_pilot, load_plan
from uasfly.drivers.watching import Watch
from uasfly.errors import UasflyError
from uasfly.flight.pilot import Pilot
from uasfly.flight.sequencer import Engage
from uasfly.link.mavsdk_link import MavsdkLink

CONNECT_TIMEOUT_S = 10.0
SWITCH_INTERVAL_S = 0.0005  # another thread at work delays a cycle by at most about this


@dataclass(frozen=True, slots=True)
class Flight:
    """What the command line was asked for."""

    mission: str
    airframe: str
    sim: bool
    url: str
    scenario: str | None
    seed: int
    controller: str
    engage: str | None
    system_id: int | None
    settings: list[str]
    log: Path | None


def fly_flight(
    flight: Flight, watch: Watch, say: Callable[[str], None], planned: Callable[[FlightPlan], None] | None = None
) -> dict[str, Any]:
    """Fly and return the summary.

    Args:
        flight: what was asked for.
        watch: called with each step's status and what the driver knows of the cycle, from a thread of its own.
        say: called with texts that are not part of a step.
        planned: called once, before anything else, with what is to be flown.

    Raises:
        UasflyError: wrong files or flags, a busy port, no vehicle.
    """
    if flight.scenario is not None and not flight.sim:
        raise UasflyError("--scenario belongs to the built-in simulation: add --sim, or leave it out on a real vehicle")
    scenario = (flight.scenario or "calm") if flight.sim else None
    plan = load_plan(
        flight.mission,
        flight.airframe,
        controller=flight.controller,
        seed=flight.seed,
        scenario=scenario,
        settings=flight.settings,
    )
    if planned is not None:
        planned(plan)
    refuse_infeasible(plan.mission, plan.airframe, say)
    engage = _engage(flight)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with _ended_in_order():
        pilot = build_pilot(plan, engage, time.perf_counter, late_counts=True)  # before anybody is kept waiting
        if not flight.sim:
            return asyncio.run(_connect_and_fly(plan, pilot, flight.url, flight.system_id, flight.log, watch, say))
        return _fly_simulated(plan, pilot, flight.log, watch, say)


def _fly_simulated(
    plan: FlightPlan, pilot: Pilot, log: Path | None, watch: Watch, say: Callable[[str], None]
) -> dict[str, Any]:
    from uasfly.sim.mavlink.process import start_process

    assert plan.scenario is not None
    assert plan.plant is not None
    port = _free_port()
    say(f"simulated {plan.airframe.name} in {plan.scenario.name}, seed {plan.seed}")
    with start_process(plan.plant, plan.scenario, plan.seed, remote_port=port, local_port=0) as vehicle:
        url = f"udpin://127.0.0.1:{port}"
        summary = asyncio.run(_connect_and_fly(plan, pilot, url, None, log, watch, say))
        if not vehicle.alive:
            summary["warnings"].append("the simulated vehicle ended by itself")
        summary["warnings"] += vehicle.complaints().splitlines()
    return summary


async def _connect_and_fly(
    plan: FlightPlan,
    pilot: Pilot,
    url: str,
    system_id: int | None,
    log: Path | None,
    watch: Watch,
    say: Callable[[str], None],
) -> dict[str, Any]:
    say(f"connecting to {url}")
    want_truth = plan.scenario is not None
    link = await MavsdkLink.connect(url, system_id=system_id, timeout_s=CONNECT_TIMEOUT_S, want_truth=want_truth)
    try:
        return await fly(plan, pilot, link, log, watch)
    finally:
        await link.close()


@contextlib.contextmanager
def _ended_in_order() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end what surrounds the flight as Ctrl-C does; in flight they go to the pilot."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _engage(flight: Flight) -> Engage:
    if flight.engage is None:
        return Engage.AUTO if flight.sim else Engage.PILOT
    try:
        return Engage(flight.engage)
    except ValueError:
        raise UasflyError(f"--engage: expected auto or pilot, found {flight.engage!r}") from None


def _free_port() -> int:
    """A UDP port on loopback that nobody has just now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
