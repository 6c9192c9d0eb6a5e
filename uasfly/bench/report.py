"""What the bench prints: one JSON object, or tables."""

from __future__ import annotations

import os
import platform
from typing import Any

from rich.table import Table
from rich.text import Text

from uasfly.bench.bench import BenchResult
from uasfly.bench.cases import SATURATED
from uasfly.bench.recommend import Recommendation, holdable_rate
from uasfly.bench.solver import SolverRow


def computer() -> dict[str, object]:
    """What this computer is."""
    return {"machine": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def as_json(result: BenchResult) -> dict[str, Any]:
    """The result as plain data; null for what was not measured."""
    observer, cycle, link, beside = result.observer, result.cycle, result.link, result.beside
    return {
        "solver": [row.as_dict() for row in result.rows],
        "observer_ms": None if observer is None else observer.odometry.as_dict(),
        "observer_with_marker_ms": None if observer is None else observer.with_marker.as_dict(),
        "detection_ms": None if result.detection is None else result.detection.as_dict(),
        "cycle_ms": None if cycle is None else cycle.cycle.as_dict(),
        "cycle_beside_detection_ms": None if beside is None else beside.cycle.as_dict(),
        "cycle_to_setpoint_ms": None if cycle is None else cycle.to_setpoint.as_dict(),
        "motion_to_setpoint_ms": None if cycle is None else cycle.motion_to_setpoint,
        "link_ms": None if link is None else link.as_dict(),
        "recommended": None if result.recommended is None else result.recommended.as_dict(),
        "acados": result.acados,
        "computer": {**computer(), "own_share": None if result.own_share is None else round(result.own_share, 3)},
        "remarks": result.remarks,
    }


def solver_table(rows: list[SolverRow]) -> Table:
    """The solver's times, reads in a terminal of 80 columns."""
    table = Table(title="Solver: ms a whole step, beside acados SQP_RTI solve() alone")
    shares = [100.0 * row.saturated_share for row in rows if row.case == SATURATED.name]
    if shares:
        table.caption = f"saturated: {min(shares):.0f} to {max(shares):.0f} % of the plans' inputs are at a bound"
    for heading in ("N", "case", "backend", "median", "p99", "max", "of acados", "its p99"):
        table.add_column(heading, justify="left" if heading in ("case", "backend") else "right")
    last = None
    for row in rows:
        if last not in (None, (row.n, row.case)):
            table.add_section()
        last = (row.n, row.case)
        figures = (row.figures.median, row.figures.p99, row.figures.max)
        ratios = ("", "") if row.ratios is None else (f"{row.ratios.median:.2f}", f"{row.ratios.p99:.2f}")
        table.add_row(str(row.n), row.case, row.backend, *(f"{value:.3f}" for value in figures), *ratios)
    return table


def parts_table(result: BenchResult) -> Table | None:
    """Everything but the solver; None where nothing of it was measured."""
    rows: list[tuple[str, dict[str, float] | None]] = []
    if result.observer is not None:
        rows.append(("observer, odometry: prediction, pose, velocity", result.observer.odometry.as_dict()))
        rows.append(("observer, the same and a marker", result.observer.with_marker.as_dict()))
    if result.detection is not None:
        rows.append(("marker detection, whole picture (640 x 480)", result.detection.whole.as_dict()))
        rows.append(("marker detection, where it is expected", result.detection.region.as_dict()))
    if result.link is not None:
        rows.append(("link, telemetry out to setpoint in", result.link.as_dict()))
    if result.cycle is not None:
        rows.append(("whole cycle, all but sleeping", result.cycle.cycle.as_dict()))
        rows.append(("of it, up to the setpoint", result.cycle.to_setpoint.as_dict()))
        rows.append(("motion true to setpoint sent", result.cycle.motion_to_setpoint))
    if result.beside is not None:
        rows.append(("whole cycle, markers detected beside it", result.beside.cycle.as_dict()))
    if not rows:
        return None
    table = Table(title="The rest, in ms")
    table.add_column("")
    for heading in ("median", "p99", "max"):
        table.add_column(heading, justify="right")
    for name, figures in rows:
        if figures is not None:
            table.add_row(name, *(f"{figures[key]:.3f}" for key in ("median", "p99", "max")))
    return table


def rates_table(result: BenchResult) -> Table | None:
    """Which rate each size can be flown at here; None without a measured cycle."""
    if result.cycle is None:
        return None
    table = Table(title="Rate that this computer can hold")
    for heading in ("N", "cycle p99, saturated [ms]", "Hz"):
        table.add_column(Text(heading), justify="right")
    for n, solver_ms in sorted(result.solver_p99_ms().items()):
        cycle_ms = result.cycle.rest_p99_ms + solver_ms
        table.add_row(str(n), f"{cycle_ms:.2f}", f"{holdable_rate(cycle_ms):g}")
    return table


def recommendation_lines(recommended: Recommendation) -> str:
    """Lines for the airframe file."""
    return (
        f"controller: # {recommended.why}\n"
        f"  rate_hz: {recommended.rate_hz}\n"
        f"  horizon_s: {recommended.horizon_s}\n"
        f"  nodes: {recommended.nodes}"
    )
