"""Finds out what the preflight check wants to know and telemetry does not tell."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Mapping

import numpy as np

from uasfly.drivers.plan import FlightPlan, build_controller
from uasfly.flight.preflight import PARAMETERS
from uasfly.frames import quaternion_from_euler
from uasfly.link.protocol import InspectedLink
from uasfly.messages import Array, FactsSample, NamedValue, StateEstimate
from uasfly.trajectories.hold import HoldTrajectory

POLLED_AFTER_S = 0.2  # what has piled up while the link was set up has been taken by then
RATES_AFTER_S = 1.0  # rates are those of the last 64 messages: by then all of them came at the rate asked for
WARM_STEPS, COLD_STEPS = 200, 20
SWING_M, SWING_S = 0.2, 2.0  # the vehicle strays so far and comes back, so that each step has something to solve


async def gather_facts(link: InspectedLink, solve_ms: tuple[float, ...]) -> FactsSample:
    """Ask the vehicle for parameters and home, and measure rates; takes one second, or up to 2.4 s without answers.

    Args:
        link: the connected vehicle; somebody else polls it.
        solve_ms: the answer of `time_solver`.

    Raises:
        LinkError: the link was closed.
    """
    parameters, home, losses = await asyncio.gather(link.read_parameters(PARAMETERS), link.home(), _count_losses(link))
    return FactsSample(
        time_s=time.monotonic(),
        parameters=tuple(NamedValue(k, math.nan if v is None else v) for k, v in parameters.items()),
        home=home,
        rates_hz=_named(link.message_rates()),
        losses=losses,
        round_trip_s=link.round_trip_s,
        solve_ms=solve_ms,
    )


def time_solver(plan: FlightPlan) -> tuple[float, ...]:
    """Times [ms] of warm steps of the plan's controller on this computer, each moved on by a control period.

    A controller of its own is used, so that the one that flies starts untouched. Takes some tenths of a second.

    Returns:
        Nothing for a controller without a solver.
    """
    if plan.controller != "nmpc":
        return ()
    controller = build_controller(plan, time.perf_counter, late_counts=True)
    reference = HoldTrajectory(np.zeros(3), 0.0)
    times = np.arange(COLD_STEPS + WARM_STEPS) / plan.airframe.controller.rate_hz
    steps = [controller.step(now, _swinging(now), reference.sample, None) for now in times.tolist()]
    return tuple(step.solve_ms for step in steps[COLD_STEPS:])


async def _count_losses(link: InspectedLink) -> tuple[NamedValue, ...]:
    await asyncio.sleep(POLLED_AFTER_S)
    before = link.losses()
    await asyncio.sleep(RATES_AFTER_S - POLLED_AFTER_S)
    return _named({cause: count - before.get(cause, 0) for cause, count in link.losses().items()})


def _swinging(time_s: float) -> StateEstimate:
    """A vehicle that swings around the point where it is to hold, in a wind that turns."""
    phase, rate = 2.0 * math.pi * time_s / SWING_S, 2.0 * math.pi / SWING_S
    way, zero = np.array((math.cos(phase), math.sin(phase), 0.0)), np.zeros(3)
    across = np.array((-math.sin(phase), math.cos(phase), 0.0))
    level: Array = quaternion_from_euler(0.05 * math.sin(phase), 0.05 * math.cos(phase), 0.0)
    return StateEstimate(time_s, SWING_M * way, SWING_M * rate * across, level, zero, way, zero, zero, zero, zero)


def _named(values: Mapping[str, float]) -> tuple[NamedValue, ...]:
    return tuple(NamedValue(name, float(value)) for name, value in values.items())
