"""A flight over MAVSDK from flags to summary: files, link, simulated vehicle where asked, and nothing left running."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from uasfly.drivers.checking import refuse_infeasible
from uasfly.drivers.live import fly
from uasfly.drivers.live_eyes import LiveEyes, open_eyes
from uasfly.drivers.plan import FlightPlan, build_pilot, load_plan
from uasfly.drivers.preflight import gather_facts, time_solver
from uasfly.drivers.sight import NO_SIGHT, SightOptions
from uasfly.drivers.watching import Watch
from uasfly.errors import UasflyError
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port

CONNECT_TIMEOUT_S = 10.0
LISTEN_S = 2.5  # for a second vehicle: two heartbeats and a half
SIMULATED_ID = 1
SWITCH_INTERVAL_S = 0.0005  # another thread at work delays a cycle by at most about this


@dataclass(frozen=True, slots=True)
class Flight:
    """What the command line was asked for; `only_check` ends it after the preflight check."""

    mission: str
    airframe: str
    sim: bool
    url: str
    scenario: str | None
    seed: int
    controller: str
    engage: str | None
    system_id: int | None
    settings: list[str] = field(default_factory=list)
    log: Path | None = None
    only_check: bool = False
    sight: SightOptions = NO_SIGHT


@dataclass(frozen=True, slots=True)
class _Prepared:
    """What is ready before anybody is kept waiting."""

    plan: FlightPlan
    pilot: Pilot
    solve_ms: tuple[float, ...]
    log: Path | None
    watch: Watch
    say: Callable[[str], None]


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
        UasflyError: wrong files or flags, a busy port, no vehicle, several vehicles and no system id.
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
        sight=flight.sight,
    )
    if plan.sight is not None and plan.sight.modelled:
        raise UasflyError("--camera model belongs to rehearsals; a simulated flight has rendered pictures, as a stream")
    if planned is not None:
        planned(plan)
    refuse_infeasible(plan.mission, plan.airframe, say)
    engage = _engage(flight)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with _ended_in_order():
        pilot = build_pilot(
            plan, engage, time.perf_counter, late_counts=True, preflight=True, only_check=flight.only_check
        )
        prepared = _Prepared(plan, pilot, time_solver(plan), flight.log, watch, say)
        if not flight.sim:
            return asyncio.run(_connect_and_fly(prepared, flight.url, flight.system_id))
        return _fly_simulated(prepared)


def _fly_simulated(prepared: _Prepared) -> dict[str, Any]:
    from uasfly.sim.mavlink.process import start_process

    plan = prepared.plan
    assert plan.scenario is not None
    assert plan.plant is not None
    port = free_udp_port()
    prepared.say(f"simulated {plan.airframe.name} in {plan.scenario.name}, seed {plan.seed}")
    scenario, scene, camera = plan.scenario, None, None
    if plan.sight is not None and plan.sight.source is None and plan.sight.scene is not None:
        scene, camera = plan.sight.scene, plan.sight.camera
        scenario = scenario.model_copy(update={"camera": scene.settings})
    with start_process(
        plan.plant,
        scenario,
        plan.seed,
        remote_port=port,
        local_port=0,
        camera=camera,
        bundle=None if scene is None else scene.bundle,
        others=() if scene is None else scene.others,
    ) as vehicle:
        url = f"udpin://127.0.0.1:{port}"
        summary = asyncio.run(_connect_and_fly(prepared, url, SIMULATED_ID, vehicle.camera_url))
        if not vehicle.alive:
            summary["warnings"].append("the simulated vehicle ended by itself")
        summary["warnings"] += vehicle.complaints().splitlines()
    return summary


async def _connect_and_fly(
    prepared: _Prepared, url: str, system_id: int | None, camera_url: str = ""
) -> dict[str, Any]:
    """Fly over a link; `camera_url` is the simulated camera's stream, "" where there is none."""
    with open_eyes(prepared.plan.sight, camera_url) as eyes:
        prepared.say(f"connecting to {url}")
        return await _connect_and_look(prepared, url, system_id, eyes)


async def _connect_and_look(
    prepared: _Prepared, url: str, system_id: int | None, eyes: LiveEyes | None
) -> dict[str, Any]:
    link = await MavsdkLink.connect(
        url,
        system_id=system_id,
        timeout_s=CONNECT_TIMEOUT_S,
        want_truth=prepared.plan.scenario is not None,
        listen_s=LISTEN_S,
    )
    try:
        gather = partial(gather_facts, link, prepared.solve_ms)
        return await fly(prepared.plan, prepared.pilot, link, prepared.log, prepared.watch, gather, eyes)
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
