"""`uasfly bench`: how fast this computer is, and what an airframe file should set for it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # imported where they are needed, so that the command line starts fast
    from uasfly.bench.bench import BenchResult


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="bench")(bench)


def bench(
    airframe: str | None = typer.Option(
        None, "--airframe", help="Airframe: a shipped name (f550, the default) or a file."
    ),
    nodes: str | None = typer.Option(
        None, "--nodes", help="Sizes of the solver's problem, as 30,60 (default: 10..160)."
    ),
    backend: list[str] | None = typer.Option(
        None, "--backend", help="c, vm or piqp; may be given several times (default: all that are to be had)."
    ),
    acados: Path | None = typer.Option(None, "--acados", help="Folder into which comma-deps-acados was installed."),
    quick: bool = typer.Option(False, "--quick", help="Less of everything: half a minute, figures that are less sure."),
    solver_only: bool = typer.Option(False, "--solver-only", help="Measure nothing but the solver."),
    recommend: str | None = typer.Option(
        None,
        "--recommend",
        help="Write rate, horizon and nodes into this airframe file; of a shipped one (f550) a copy is made here.",
    ),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object instead of tables."),
) -> None:
    """Measure solver, observer, whole cycle and link on this computer; takes a bit more than a minute.

    With comma-deps-acados installed, acados solves the same problems in turn with uasfly.

    Example: [bold]uasfly bench --nodes 30,60 --recommend my_airframe.yaml[/]
    """
    from uasfly.airframe import Airframe
    from uasfly.airframe_file import find_target
    from uasfly.bench.airframe_file import write_recommendation
    from uasfly.bench.bench import BenchSettings, run_bench
    from uasfly.bench.report import as_json as plain
    from uasfly.cli.progress import BenchProgress
    from uasfly.errors import UasflyError
    from uasfly.files import find_file, load_file

    if recommend is not None and (airframe is not None or solver_only):
        other = "--airframe: the file it changes is the one that is measured" if airframe else "--solver-only"
        raise UasflyError(f"--recommend does not go with {other}")
    target = None if recommend is None else find_target(recommend, "--recommend")
    settings = BenchSettings(
        airframe=load_file(find_file("airframe", airframe or "f550") if target is None else target.source, Airframe),
        nodes=_numbers(nodes),
        backends=tuple(backend or ()),
        acados=acados,
        quick=quick,
    )
    with BenchProgress() as progress:
        result = run_bench(settings, progress.update, solver_only=solver_only)
    if as_json:
        print(json.dumps(plain(result), indent=2))
    else:
        _show(result)
    if target is not None:
        if result.recommended is None:
            typer.echo(f"{target.path} stays as it is: there is nothing to recommend", err=True)
            raise typer.Exit(1)
        changes = write_recommendation(target, result.recommended) or ["nothing to change"]
        typer.echo(f"{target.path}: {', '.join(changes)}", err=True)


def _show(result: BenchResult) -> None:
    from rich.console import Console

    from uasfly.bench.report import parts_table, rates_table, recommendation_lines, solver_table

    console = Console()
    for table in (solver_table(result.rows), parts_table(result), rates_table(result)):
        if table is not None:
            console.print(table)
    if result.recommended is not None:
        console.print("For the airframe file (--recommend FILE writes it):")
        print(recommendation_lines(result.recommended))
    for remark in result.remarks:
        console.print(remark, markup=False, highlight=False)


def _numbers(text: str | None) -> tuple[int, ...]:
    from uasfly.errors import UasflyError, shortened

    if text is None:
        return ()
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise UasflyError(f"--nodes: expected numbers with commas between them, found {shortened(text)!r}") from None
