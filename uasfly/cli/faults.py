"""`uasfly faults`: fly every fault and print what was expected, what happened, how soon, and how far it strayed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.table import Table

from uasfly.cli import options

if TYPE_CHECKING:
    from uasfly.drivers.faults.outcome import Outcome

EXIT_FAILED = 1


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="faults")(faults)


def faults(
    names: list[str] | None = typer.Argument(None, help="Faults to fly; all when none is named."),
    seed: options.Seed = 1,
    rehearsed: bool = typer.Option(False, "--rehearsed", help="Only those that are flown as rehearsals (fast)."),
    listing: bool = typer.Option(False, "--list", help="List the faults and what is expected; fly nothing."),
    as_json: bool = typer.Option(False, "--json", help="Print a JSON list."),
) -> None:
    """Fly faults on the simulated vehicle and say whether each ended as it should; exit code 1 where one did not.

    Most are rehearsals; those that stop, kill or disturb the program itself are flown over MAVLink in real time.
    All of them take about five minutes.

    Example: [bold]uasfly faults gnss_jump frozen[/]
    """
    from uasfly.drivers.faults.outcome import sentence
    from uasfly.drivers.faults.table import fly_table, select_cases

    cases = select_cases(names or [], rehearsed)
    console = Console(stderr=True)
    if listing:
        for case in cases:
            print(f"{case.name}: {case.fault}: {sentence(case.expected)}")
        return

    done = 0

    def told(outcome: Outcome) -> None:
        nonlocal done
        done += 1
        verdict = "as expected" if outcome.as_expected else "NOT as expected"
        console.print(f"{done}/{len(cases)} {outcome.case.name}: {verdict}", highlight=False, markup=False)

    outcomes = fly_table(cases, seed, told)
    if as_json:
        print(json.dumps([outcome.as_dict() for outcome in outcomes], indent=2))
    else:
        _print(outcomes)
    if not all(outcome.as_expected for outcome in outcomes):
        raise typer.Exit(EXIT_FAILED)


def _print(outcomes: list[Outcome]) -> None:
    from uasfly.drivers.faults.outcome import sentence

    table = Table(title="Faults: what happened, how soon, how far the vehicle strayed")
    for heading in ("fault", "expected", "observed", "reaction s", "strayed m", ""):
        table.add_column(heading, overflow="fold")
    for outcome in outcomes:
        reaction = "" if outcome.reaction_s is None else f"{outcome.reaction_s:.2f}"
        same = outcome.observed == outcome.case.expected
        table.add_row(
            outcome.case.fault,
            sentence(outcome.case.expected),
            "as expected" if same else sentence(outcome.observed),
            reaction,
            f"{outcome.strayed_m:.2f}",
            "ok" if outcome.as_expected else "; ".join(outcome.problems),
            style="" if outcome.as_expected else "red",
        )
    Console().print(table)
