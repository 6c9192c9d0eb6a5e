"""What the bench prints: one JSON object, or tables."""

from __future__ import annotations

import os
import platform
from typing import Any

from rich.table import Table

from uasfly.bench.bench import SolverResult
from uasfly.bench.solver import SolverRow


def computer() -> dict[str, object]:
    """What this computer is."""
    return {"machine": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def as_json(solver: SolverResult) -> dict[str, Any]:
    """The result as plain data."""
    return {
        "solver": [row.as_dict() for row in solver.rows],
        "observer_ms": None,
        "cycle_ms": None,
        "link_ms": None,
        "recommended": None,
        "acados": solver.acados,
        "computer": computer(),
        "remarks": solver.remarks,
    }


def solver_table(rows: list[SolverRow]) -> Table:
    """The solver's times, reads in a terminal of 80 columns."""
    table = Table(title="Solver: ms a whole step, beside acados SQP_RTI solve() alone")
    for heading in ("N", "case", "backend", "median", "p99", "max", "of acados", "its p99"):
        table.add_column(heading, justify="left" if heading in ("case", "backend") else "right")
    last = None
    for row in rows:
        if last not in (None, (row.n, row.case)):
            table.add_section()
        last = (row.n, row.case)
        figures = (row.figures.median, row.figures.p99, row.figures.max)
        ratios = ("", "") if row.ratios is None else (f"{row.ratios.median:.2f}", f"{row.ratios.p99:.2f}")
        case = row.case if row.case == "nominal" else f"{100 * row.saturated_share:.0f} % saturated"
        table.add_row(str(row.n), case, row.backend, *(f"{value:.3f}" for value in figures), *ratios)
    return table
