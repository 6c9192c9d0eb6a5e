"""`uasfly reproduce`: a paper's experiments flown again, its figures beside uasfly's."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from uasfly.cli import options
from uasfly.reproduce.papers import PAPERS

_LISTED = "; ".join(f"{name}: {title}" for name, title in PAPERS.items())


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="reproduce")(reproduce)


def reproduce(
    paper: str = typer.Argument(metavar="|".join(PAPERS), help=f"Which paper. {_LISTED}."),
    out: Path | None = typer.Option(None, "--out", help="Write rows (JSON) and pictures (PNG) into this folder."),
    seed: options.Seed = 1,
    as_json: bool = typer.Option(False, "--json", help="Print a JSON list of rows instead of a table."),
) -> None:
    """Fly a paper's experiments again and print its figures beside uasfly's.

    Where the paper gives no number, its column is empty and the note says what it found.

    Example: [bold]uasfly reproduce asignacion2022 --out pictures[/]
    """
    from rich.console import Console

    from uasfly.cli.progress import ReproduceProgress
    from uasfly.reproduce import papers, report

    papers.check_paper(paper)
    if out is not None:
        report.prepare_folder(out)
    with ReproduceProgress(paper) as progress:
        result = papers.reproduce(paper, seed, progress.update)
    if as_json:
        print(json.dumps(report.as_json(result), indent=2))
    else:
        Console().print(report.table(result, f"{PAPERS[paper]} (seed {seed})"))
    if out is not None:
        for path in report.write_folder(result, out):
            typer.echo(f"written: {path}", err=True)
