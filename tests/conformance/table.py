"""All rows, and the table that they make."""

from __future__ import annotations

import pytest
from rich import box
from rich.console import Console
from rich.table import Table

from tests.conformance.commands import command_rows
from tests.conformance.excitation import excitation_rows, reference_rows
from tests.conformance.failsafe import failsafe_rows
from tests.conformance.fields import field_rows
from tests.conformance.modes import mode_rows
from tests.conformance.recording import conformance
from tests.conformance.replay import fly
from tests.conformance.responses import response_rows
from tests.conformance.rows import Row
from tests.conformance.streams import stream_rows

ROWS = pytest.StashKey[list[Row]]()  # where a test run keeps its rows until it ends
_WIDTH = 170


def recorded_rows() -> list[Row]:
    """Every row that a recording stands behind; skips where there is none."""
    recording = conformance()
    flight = fly(recording)
    comparisons = (stream_rows, command_rows, mode_rows, failsafe_rows, field_rows, response_rows)
    return [row for compare in comparisons for row in compare(recording, flight)] + excitation_rows()


def all_rows() -> list[Row]:
    """The whole table; skips where there is no recording."""
    return recorded_rows() + reference_rows()


def summary(rows: list[Row]) -> str:
    """One line."""
    outside = sum(not row.within for row in rows)
    verdict = f"{outside} outside their tolerances" if outside else "all within their tolerances"
    return f"conformance: {len(rows)} rows, {verdict}"


def table_text(rows: list[Row]) -> str:
    """The rows as a table of plain text; reasons are numbered and stand below."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("aspect", "item", "PX4", "simulated", "difference", "tolerance", "within", "reason"):
        table.add_column(heading, overflow="fold")
    reasons = list(dict.fromkeys(row.reason for row in rows if row.reason))
    last = ""
    for row in rows:
        aspect, last = ("" if row.aspect == last else row.aspect), row.aspect
        number = f"({reasons.index(row.reason) + 1})" if row.reason else ""
        values = (row.recorded, row.simulated, row.difference, row.tolerance)
        table.add_row(aspect, row.item, *values, "yes" if row.within else "NO", number)
    notes = [f"({number}) {reason}" for number, reason in enumerate(reasons, 1)]
    console = Console(width=_WIDTH, force_terminal=False, markup=False, highlight=False)
    with console.capture() as capture:
        console.print(table)
    return "\n".join([*(line.rstrip() for line in capture.get().splitlines()), *notes, ""])
