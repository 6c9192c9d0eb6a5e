"""`uasfly campaign`: airframes x missions x scenarios x seeds x overrides, flown as rehearsals on all cores."""

from __future__ import annotations

import json
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:  # imported where they are needed, so that the command line starts fast
    from uasfly.campaign.flights import FlightList
    from uasfly.campaign.run import Where

EXIT_ERRORS = 1
EXIT_INTERRUPTED = 130
USUAL_FACTOR = 20.0  # times real time on one core, where nothing has been flown yet that tells better
LISTED = 20


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="campaign")(campaign)


def campaign(
    file: Path = typer.Argument(help="Campaign file (YAML)."),
    out: Path | None = typer.Option(None, "--out", help="Results folder; FILE-results when not given."),
    workers: int | None = typer.Option(
        None, "--workers", min=1, max=1024, help="Processes on this machine; all cores when not given."
    ),
    scheduler: str | None = typer.Option(
        None, "--scheduler", help="Fly on the Dask cluster at this address (tcp://10.0.0.5:8786) instead."
    ),
    dry_run: bool = typer.Option(False, "--dry-run", help="Check everything and list what would be flown."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object instead of tables."),
) -> None:
    """Fly many rehearsals and say how well they went, with confidence intervals.

    Every airframe flies every mission in every scenario with every controller, swept value and seed. Started again,
    it flies what is missing. The results folder holds flights.parquet (a row a flight, with the command that repeats
    it), summary.json, report.md and pictures. Exit code 1: a flight ended in an error (an aborted one is a result).

    Example: [bold]uasfly campaign gusts.yaml --workers 4 --out gusts[/]
    """
    from uasfly.campaign.execute import ONE_THREAD

    for name, value in ONE_THREAD.items():  # before numpy comes
        os.environ.setdefault(name, value)
    from uasfly.campaign.flights import FlightList
    from uasfly.campaign.run import Where, run_campaign
    from uasfly.cli.campaign_output import CampaignProgress, print_summary
    from uasfly.errors import UasflyError

    if scheduler is not None and workers is not None:
        raise UasflyError("--workers counts processes on this machine; a cluster (--scheduler) has its own: give one")
    flights = FlightList(file, lambda text: typer.echo(text, err=True))
    folder = out if out is not None else Path(f"{file.stem}-results")
    where = Where(workers, scheduler)
    if dry_run:
        _dry_run(flights, folder, where, as_json=as_json)
        return
    progress = CampaignProgress(file.stem)
    try:
        with progress:
            summary = run_campaign(flights, folder, where, lambda text: typer.echo(text, err=True), progress)
    except KeyboardInterrupt:
        again = shlex.join(["uasfly", *sys.argv[1:]])
        typer.echo(f"interrupted; {progress.count} of {len(flights.flights)} flights are kept in {folder}", err=True)
        typer.echo(f"to fly the others: {again}", err=True)
        raise typer.Exit(EXIT_INTERRUPTED) from None
    if as_json:
        print(json.dumps(summary, indent=2))
    else:
        print_summary(summary)
    if summary["errors"]:
        raise typer.Exit(EXIT_ERRORS)


def _dry_run(flights: FlightList, folder: Path, where: Where, *, as_json: bool) -> None:
    from uasfly.campaign.folder import journal_results
    from uasfly.campaign.run import missing_flights

    results = journal_results(folder)
    missing = missing_flights(flights, results)
    factors = [factor for row in results.values() if (factor := row.get("timing_real_time_factor"))]
    factor = sorted(factors)[len(factors) // 2] if factors else USUAL_FACTOR
    flight_s = sum(flights.duration_s(flight) for flight in missing)
    processes = where.processes(len(missing)) if where.scheduler is None else None
    plan: dict[str, Any] = {
        "flights": len(flights.flights),
        "kept": len(flights.flights) - len(missing),
        "missing": len(missing),
        "flight_time_s": round(flight_s, 1),
        "estimated_s": None if processes is None else round(flight_s / factor / processes, 1),
        "processes": processes,
        "folder": str(folder),
    }
    if as_json:
        print(json.dumps({**plan, "commands": [flights.command(flight) for flight in missing]}, indent=2))
        return
    print(f"{plan['flights']} flights: {flights.campaign.arithmetic()}")
    print(f"{plan['kept']} are in {folder} already, {plan['missing']} would be flown")
    if processes is not None and missing:
        basis = "as those before" if factors else "assumed"
        print(
            f"about {plan['estimated_s'] / 60.0:.1f} min in {processes} processes "
            f"({flight_s / 60.0:.0f} min of flight at {factor:.0f} times real time, {basis})"
        )
    for flight in missing[:LISTED]:
        print(flights.command(flight))
    if len(missing) > LISTED:
        print(f"... and {len(missing) - LISTED} more (all with --json)")
