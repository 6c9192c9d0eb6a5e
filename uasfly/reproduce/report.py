"""A reproduction as plain data, as a table, and as a folder with its pictures."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from uasfly.errors import FileError, UasflyError
from uasfly.reproduce.rows import Reproduction

_VERDICTS = {True: "yes", False: "no", None: ""}


def as_json(result: Reproduction) -> list[dict[str, Any]]:
    """One object a row, with the names of `Row`."""
    return [asdict(row) for row in result.rows]


def table(result: Reproduction, title: str) -> Table:
    """The paper beside uasfly, row by row."""
    shown = Table(title=escape(title))
    for heading in ("experiment", "quantity", "paper", "uasfly", "better", "note"):
        shown.add_column(heading, justify="right" if heading in ("paper", "uasfly") else "left", overflow="fold")
    last = None
    for row in result.rows:
        if last not in (None, row.experiment):
            shown.add_section()
        quantity = f"{row.quantity} [{row.unit}]" if row.unit else row.quantity
        paper = "" if row.paper is None else f"{row.paper:.4g}"
        cells = (row.experiment if row.experiment != last else "", quantity, paper, f"{row.uasfly:.4g}")
        style = "yellow" if row.better is False else ""
        shown.add_row(*(escape(cell) for cell in (*cells, _VERDICTS[row.better], row.note)), style=style)
        last = row.experiment
    return shown


def prepare_folder(folder: Path) -> None:
    """Make the folder before anything is flown, and see that pictures can be drawn.

    Raises:
        FileError: where the folder cannot be made or written to.
        UasflyError: where matplotlib is missing.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(str(folder), [f"the folder cannot be made ({error.strerror}); name another one"]) from None
    if not os.access(folder, os.W_OK):
        raise FileError(str(folder), ["nothing may be written into this folder; name another one"])
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        problem = "drawing pictures needs matplotlib; install it (pip install 'uasfly[campaign]') or leave --out away"
        raise UasflyError(problem) from None


def write_folder(result: Reproduction, folder: Path) -> list[Path]:
    """Write PAPER.json and draw every picture as PAPER_STEM.png; gives the files."""
    written = [folder / f"{result.paper}.json"]
    written[0].write_text(json.dumps(as_json(result), indent=2) + "\n", encoding="utf-8")
    for stem, draw in result.pictures.items():
        written.append(folder / f"{result.paper}_{stem}.png")
        draw(written[-1])
    return written
