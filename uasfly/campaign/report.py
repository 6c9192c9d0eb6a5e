"""What a campaign leaves behind: the table, the summary, the pictures and a report for people."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from uasfly import __version__
from uasfly.campaign.cluster import INSTALL
from uasfly.campaign.flights import FlightList
from uasfly.campaign.folder import ResultsFolder
from uasfly.campaign.identity import code_digest
from uasfly.campaign.statistics import CONFIDENCE, Group, label, summarise, worst
from uasfly.campaign.table import Row, write_parquet

TABLE, SUMMARY, REPORT = "flights.parquet", "summary.json", "report.md"
WORST_FLIGHTS = 10
WORST_COLUMNS = ("index", "outcome", "reason", "seed", "tracking_rms_m", "tracking_max_m", "command")


def write_results(folder: ResultsFolder, flights: FlightList, rows: list[Row]) -> dict[str, Any]:
    """Write everything that can be written and return the summary.

    Where the extra is not installed, table and pictures are left out, and `notes` of the summary says so; the journal
    keeps the results until they can be made.

    Raises:
        FileError: when something cannot be written.
    """
    overrides = flights.campaign.overrides
    swept = list(overrides.swept)
    files: list[Path] = []
    notes: list[str] = []
    if _installed("pyarrow"):
        files.append(folder.write(TABLE, partial(write_parquet, rows=rows, fields=overrides.keys())))
    else:
        notes.append(f"{TABLE} needs pyarrow: {INSTALL}, then start the campaign again; no flight is flown twice")
    pictures: list[tuple[str, str]] = []
    if rows and _installed("matplotlib"):
        from uasfly.campaign.pictures import rms_boxes, success_against_wind, worst_flights

        for name, title, draw in (
            ("rms.png", "Tracking RMS by group", partial(rms_boxes, rows, swept)),
            ("wind.png", "Success rate against wind", partial(success_against_wind, rows)),
            ("worst.png", "Worst flights", partial(worst_flights, rows, swept)),
        ):
            files.append(folder.write(name, draw))
            pictures.append((name, title))
    elif rows:
        notes.append(f"the pictures need matplotlib: {INSTALL}, then start the campaign again")
    summary = summary_of(flights, rows, notes)
    text = json.dumps(summary, indent=2) + "\n"
    files.append(folder.write(SUMMARY, lambda path: path.write_text(text, encoding="utf-8")))
    report = report_text(flights, summary, pictures)
    files.append(folder.write(REPORT, lambda path: path.write_text(report, encoding="utf-8")))
    return {**summary, "folder": str(folder.path), "files": [str(path) for path in files]}


def summary_of(flights: FlightList, rows: Sequence[Row], notes: Sequence[str] = ()) -> dict[str, Any]:
    """The campaign as one object: counts, groups with their intervals, the worst flights."""
    groups = summarise(rows, list(flights.campaign.overrides.swept))
    return {
        "campaign": flights.path.name,
        "description": flights.campaign.description,
        "uasfly": __version__,
        "code": code_digest(),
        "flights": len(flights.flights),
        "flown": len(rows),
        "successes": sum(row["success"] for row in rows),
        "errors": sum(row["outcome"] == "error" for row in rows),
        "success": flights.campaign.success.model_dump(mode="json"),
        "confidence": CONFIDENCE,
        "groups": [group.as_dict() for group in groups],
        "worst": [{name: row[name] for name in WORST_COLUMNS} for row in worst(rows, WORST_FLIGHTS)],
        "notes": list(notes),
    }


def report_text(flights: FlightList, summary: dict[str, Any], pictures: Sequence[tuple[str, str]]) -> str:
    """The report in Markdown."""
    rms = summary["success"]["tracking_rms_m"]
    measure = "completed" + (f" with a tracking RMS of at most {100.0 * rms:g} cm" if rms is not None else "")
    lines = [f"# Campaign {summary['campaign']}", ""]
    if summary["description"]:
        lines += [summary["description"], ""]
    lines += [
        f"{summary['flown']} of {summary['flights']} flights ({flights.campaign.arithmetic()}), "
        f"{summary['successes']} successful ({measure}), {summary['errors']} ended in an error; "
        f"uasfly {summary['uasfly']}, code {summary['code']}.",
        "",
        f"Intervals are {100.0 * CONFIDENCE:g} %: Wilson's for rates, bootstrapped for medians, Student's for means. "
        "RMS is of truth minus reference over the completed flights.",
        "",
        "| " + " | ".join(GROUP_HEADINGS) + " |",
        "|" + "---|" * len(GROUP_HEADINGS),
    ]
    groups = summary["groups"]
    among = [group["what"] for group in groups]
    lines += ["| " + " | ".join(_cell(cell) for cell in group_cells(group, among)) + " |" for group in groups]
    for name, title in pictures:
        lines += ["", f"## {title}", "", f"![{title}]({name})"]
    lines += ["", "## Commands that repeat the worst flights", ""]
    for flight in summary["worst"]:
        lines += [f"- {flight_text(flight)}", "", "  ```sh", f"  {flight['command']}", "  ```"]
    return "\n".join([*lines, *(f"\n{note}" for note in summary["notes"])]) + "\n"


GROUP_HEADINGS = ("group", "flights", "success", "median RMS [cm]", "mean RMS [cm]", "worst [cm]")


def group_cells(group: dict[str, Any] | Group, among: Sequence[dict[str, Any]]) -> list[str]:
    """A group as texts under `GROUP_HEADINGS`."""
    figures = group.as_dict() if isinstance(group, Group) else group
    low, high = figures["success_rate_interval"]
    success = f"{100.0 * figures['success_rate']:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"
    return [
        label(figures["what"], among),
        str(figures["flights"]),
        success,
        _centimetres(figures["rms_median_m"], figures["rms_median_interval_m"]),
        _centimetres(figures["rms_mean_m"], figures["rms_mean_interval_m"]),
        _centimetres(figures["rms_worst_m"], None),
    ]


def flight_text(flight: dict[str, Any]) -> str:
    """A flight among the worst in one line."""
    reason = f" ({flight['reason']})" if flight["reason"] else ""
    rms = _centimetres(flight["tracking_rms_m"], None)
    return f"flight {flight['index']}, seed {flight['seed']}: {flight['outcome']}{reason}, RMS {rms} cm"


def _centimetres(value: float | None, interval: Sequence[float] | None) -> str:
    if value is None:
        return "–"
    text = f"{100.0 * value:.2f}"
    return text if interval is None else f"{text} ({100.0 * interval[0]:.2f} to {100.0 * interval[1]:.2f})"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _installed(module: str) -> bool:
    return importlib.util.find_spec(module) is not None
