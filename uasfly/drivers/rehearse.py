"""Flies a mission against the simulated vehicle in this process: deterministic and faster than real time."""

from __future__ import annotations

import gc
import time
from pathlib import Path
from typing import Any

from uasfly.drivers.eyes import make_eyes
from uasfly.drivers.plan import FlightPlan, build_pilot
from uasfly.drivers.sight import TrueMarkers
from uasfly.drivers.simulated_flight import SimulatedFlight
from uasfly.drivers.watching import Cycle, Watch, Witness
from uasfly.flight.choices import Engage
from uasfly.flight.summary import SummaryCollector
from uasfly.record.writer import LogWriter
from uasfly.sim.vehicle import SimulatedVehicle
from uasfly.trajectories.mission_trajectory import LONGEST_S

LONGEST_FLIGHT_S = LONGEST_S + 600.0  # the legs, and more than all time-outs of the other phases together


def rehearse(
    plan: FlightPlan, log: Path | None = None, watch: Watch | None = None, witness: Witness | None = None
) -> dict[str, Any]:
    """Fly a plan and return its summary.

    The same plan gives the same log, bit for bit; only the summary's times and real-time factor depend on the machine.

    Args:
        plan: what to fly; it must have a scenario and a plant.
        log: file for the flight log, None for none.
        watch: called with each step's status and what the driver knows of the cycle (progress, capture).
        witness: called with each step's status and all that the summary is made from.

    Raises:
        FileError: when the log cannot be opened.
    """
    assert plan.scenario is not None
    assert plan.plant is not None
    vehicle = SimulatedVehicle(plan.plant, plan.scenario, plan.seed)
    pilot = build_pilot(plan, Engage.AUTO, time.perf_counter, late_counts=False)
    true_markers = TrueMarkers(plan.sight)
    eyes = make_eyes(plan.sight, vehicle, pilot.observer, plan.seed)
    flight = SimulatedFlight(vehicle, plan.scenario.link, pilot, plan.airframe.controller.rate_hz, plan.seed, eyes=eyes)
    summary = SummaryCollector()
    writer = LogWriter(log, plan.description()) if log is not None else None
    started = time.perf_counter()
    gc.collect()
    gc.freeze()  # what lives now lives to the end: looking through it again and again costs time
    try:
        while not pilot.done and not flight.lasted(LONGEST_FLIGHT_S):
            cycle = flight.cycle()
            now_s, result = cycle.now_s, cycle.result
            if result.setpoint is not None:
                summary.setpoint_sent(now_s)
            solve_ms = None if result.control is None else result.control.solve_ms
            summary.timed(solve_ms, cycle.cycle_ms)
            seen, datum = (*cycle.samples, cycle.truth), true_markers.datum(pilot.observer)
            summary.cycle(result.status, seen, datum)
            if witness is not None:
                witness(result.status, seen, datum)
            if writer is not None:
                for message in (*seen, *result.requests, result.setpoint, result.status):
                    if message is not None:
                        writer.write(message, now_s)
            if watch is not None:
                watch(result.status, Cycle(result.setpoint is not None, cycle.cycle_ms, solve_ms))
    finally:
        gc.unfreeze()
        if writer is not None:
            writer.close()
            if writer.problem:
                summary.warn(writer.problem)
    wall_s = time.perf_counter() - started
    return summary.result(wall_s=wall_s, rejected=pilot.observer.counters.rejected, **plan.identity())
