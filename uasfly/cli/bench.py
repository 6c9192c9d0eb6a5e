"""`uasfly bench`: how fast this computer is, and what an airframe file should set for it."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from uasfly.cli import options


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="bench")(bench)


def bench(
    airframe: options.Airframe = "f550",
    nodes: str | None = typer.Option(
        None, "--nodes", help="Sizes of the solver's problem, e.g. 30,60 (default 10..160)."
    ),
    backend: list[str] | None = typer.Option(
        None, "--backend", help="c, vm or piqp; may be given several times (default: all that are to be had)."
    ),
    acados: Path | None = typer.Option(None, "--acados", help="Folder into which comma-deps-acados was installed."),
    quick: bool = typer.Option(False, "--quick", help="A quarter of the time, less sure figures."),
    solver_only: bool = typer.Option(False, "--solver-only", help="Measure nothing but the solver."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object instead of tables."),
) -> None:
    """Measure solver, observer, whole cycle and link on this computer; takes about a minute.

    Example: [bold]uasfly bench --nodes 30,60 --json[/]
    """
    from rich.console import Console

    from uasfly.airframe import Airframe
    from uasfly.bench.bench import BenchSettings, bench_solver
    from uasfly.bench.report import as_json as plain
    from uasfly.bench.report import solver_table
    from uasfly.cli.progress import BenchProgress
    from uasfly.files import find_file, load_file

    settings = BenchSettings(
        airframe=load_file(find_file("airframe", airframe), Airframe, {}),
        nodes=_numbers(nodes),
        backends=tuple(backend or ()),
        acados=acados,
        quick=quick,
    )
    with BenchProgress() as progress:
        solver = bench_solver(settings, progress.update)
    if as_json:
        print(json.dumps(plain(solver), indent=2))
        return
    console = Console()
    console.print(solver_table(solver.rows))
    for remark in solver.remarks:
        console.print(remark, markup=False, highlight=False)


def _numbers(text: str | None) -> tuple[int, ...]:
    from uasfly.errors import UasflyError, shortened

    if text is None:
        return ()
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise UasflyError(f"--nodes: expected numbers with commas between them, found {shortened(text)!r}") from None
