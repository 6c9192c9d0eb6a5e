"""Flies flights in this process, one after the other; no more than uasfly itself is needed."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Iterable, Iterator

from uasfly.campaign.flights import Flight
from uasfly.campaign.fly import Result, fly
from uasfly.drivers.plan import FlightPlan

Flown = tuple[Flight, Result]
PlanOf = Callable[[Flight], FlightPlan]

# One thread a flight: the matrices are small, and more threads than cores only push each other aside.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
ONE_THREAD = dict.fromkeys(_THREADS, "1")


def fly_here(flights: Iterable[Flight], plan_of: PlanOf, code: str) -> Iterator[Flown]:
    """Fly in this process.

    Args:
        flights: what to fly.
        plan_of: the plan of a flight.
        code: see `fly`.
    """
    for flight in flights:
        yield flight, fly(pickle.dumps(plan_of(flight)), code)


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
