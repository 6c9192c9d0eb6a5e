"""Runs a campaign from file to report: what is missing is flown, and every flight is kept as it lands."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from uasfly.campaign.cluster import check_workers, fly_on, local_client, remote_client, require_dask
from uasfly.campaign.execute import Flown, cores, fly_here
from uasfly.campaign.flights import Flight, FlightList
from uasfly.campaign.fly import Result
from uasfly.campaign.folder import ResultsFolder
from uasfly.campaign.identity import code_digest, facts
from uasfly.campaign.interruption import Interruption
from uasfly.campaign.report import write_results
from uasfly.campaign.table import rows_of, succeeded
from uasfly.errors import UasflyError


class Progress(Protocol):
    """Whoever shows how a campaign goes on."""

    def begin(self, kept: int, total: int, successes: int) -> None:
        """Flying begins; `kept` of `total` flights are there already, `successes` of them successful."""

    def landed(self, success: bool) -> None:
        """One more flight is there."""


@dataclass(frozen=True, slots=True)
class Where:
    """Where flights are flown: `workers` processes here (all cores when None), or the cluster at `scheduler`."""

    workers: int | None = None
    scheduler: str | None = None

    def processes(self, flights: int) -> int:
        """How many processes fly on this machine: no more than there are flights."""
        return max(1, min(self.workers or cores(), flights))


def run_campaign(
    flights: FlightList, out: Path, where: Where, say: Callable[[str], None], progress: Progress
) -> dict[str, Any]:
    """Fly what is missing and return the summary.

    Args:
        flights: of the campaign.
        out: results folder.
        where: where to fly.
        say: called with texts for people.
        progress: told of each flight.

    Raises:
        UasflyError: the folder or the cluster cannot be used. KeyboardInterrupt: what has landed is kept.
    """
    if where.scheduler is not None:
        require_dask("--scheduler")
    with ResultsFolder(out) as folder:
        missing = missing_flights(flights, folder.results)
        stale = len(folder.results.keys() - {flight.id for flight in flights.flights})
        if stale:
            say(f"{stale} flights in {out} are not of this campaign as it is now; they are left out of the results")
        success = flights.campaign.success
        results = dict(folder.results)
        there = [flight for flight in flights.flights if flight.id in results]
        successes = sum(succeeded(results[flight.id], success) for flight in there)
        if missing:
            repeats = len(flights.flights) - len(there) - len(missing)
            progress.begin(len(there) + repeats, len(flights.flights), successes)
            with Interruption() as interruption, _flown(flights, missing, where, say) as flown:
                for flight, result in flown:
                    interruption.check()
                    folder.keep(flight.id, result)
                    progress.landed(succeeded(result, success))
        return write_results(folder, flights, rows_of(flights, folder.results))


def missing_flights(flights: FlightList, results: Mapping[str, Result]) -> list[Flight]:
    """What is to be flown, each id once: the same flight may stand in a campaign under two names."""
    missing = {flight.id: flight for flight in reversed(flights.flights) if flight.id not in results}
    return sorted(missing.values(), key=lambda flight: flight.index)


@contextlib.contextmanager
def _flown(
    flights: FlightList, missing: list[Flight], where: Where, say: Callable[[str], None]
) -> Iterator[Iterator[Flown]]:
    code = code_digest()
    if where.scheduler is not None:
        with remote_client(where.scheduler) as client:
            check_workers(client, facts())
            yield fly_on(client, missing, flights.plan, code)
        return
    processes = where.processes(len(missing))
    if processes > 1:
        try:
            require_dask(f"flying in {processes} processes")
        except UasflyError:
            if where.workers is not None:
                raise
            say("flying in one process: more of them need Dask, pip install 'uasfly[campaign]'")
            processes = 1
    if processes == 1:
        yield fly_here(missing, flights.plan, code)
        return
    facts()  # compiles the solver, if need be, before the workers all do
    with local_client(processes) as client:
        yield fly_on(client, missing, flights.plan, code)
