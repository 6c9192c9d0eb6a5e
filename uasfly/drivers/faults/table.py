"""Flies the fault table: rehearsals on all cores, then flights over MAVLink, some at a time."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed

from uasfly.drivers.faults.case import FaultCase
from uasfly.drivers.faults.catalogue import CATALOGUE
from uasfly.drivers.faults.live import fly_live
from uasfly.drivers.faults.outcome import Outcome
from uasfly.drivers.faults.rehearsed import fly_rehearsed
from uasfly.errors import UasflyError

LIVE_PER_CORE = 2.0  # a flight over MAVLink takes about a third of a core, its vehicle included


def select_cases(names: list[str], rehearsed_only: bool = False) -> list[FaultCase]:
    """The cases of these names, all where none is given, in the order of the table.

    Raises:
        UasflyError: for a name that is none.
    """
    known = [case.name for case in CATALOGUE]
    for name in names:
        if name not in known:
            raise UasflyError(f"faults: there is no fault {name!r}; expected one of {', '.join(known)}")
    chosen = [case for case in CATALOGUE if not names or case.name in names]
    return [case for case in chosen if not (rehearsed_only and case.over_mavlink)]


def fly_case(case: FaultCase, seed: int) -> Outcome:
    """Fly one case, however it is flown."""
    return fly_live(case, seed) if case.over_mavlink else fly_rehearsed(case, seed)


def fly_table(cases: list[FaultCase], seed: int, told: Callable[[Outcome], None]) -> list[Outcome]:
    """Fly cases and return their outcomes in the order of `cases`.

    Args:
        cases: what to fly.
        seed: of everything random.
        told: called with each outcome as it comes.
    """
    cores = os.cpu_count() or 1
    outcomes: dict[str, Outcome] = {}
    rehearsals = [case for case in cases if not case.over_mavlink]
    flights = [case for case in cases if case.over_mavlink]
    if rehearsals:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(min(cores, len(rehearsals)), mp_context=context) as pool:
            for outcome in _all(pool, rehearsals, seed):
                outcomes[outcome.case.name] = outcome
                told(outcome)
    if flights:
        with ThreadPoolExecutor(max(1, round(LIVE_PER_CORE * cores))) as threads:
            for outcome in _all(threads, flights, seed):
                outcomes[outcome.case.name] = outcome
                told(outcome)
    return [outcomes[case.name] for case in cases]


def _all(pool: Executor, cases: list[FaultCase], seed: int) -> Iterator[Outcome]:
    futures = [pool.submit(fly_case, case, seed) for case in cases]
    for future in as_completed(futures):
        yield future.result()
