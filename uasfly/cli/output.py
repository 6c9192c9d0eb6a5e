"""What flying commands print at the end, and where they write it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

_VERDICT_STYLES = {"ok": "green", "warning": "yellow", "stop": "bold red"}


def check_writable(path: Path | None, what: str) -> None:
    """Refuse a result file that cannot be written before anything flies, not after.

    Raises:
        FileError: when its folder does not exist, it is a folder, or it may not be written.
    """
    from uasfly.errors import FileError

    if path is None:
        return
    if path.is_dir():
        raise FileError(str(path), [f"expected a file for the {what}, found a folder"])
    if not path.parent.is_dir():
        raise FileError(str(path), [f"the folder for the {what} does not exist; make it first"])
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise FileError(str(path), [f"the {what} may not be written here; choose another place"])


def finish(summary: dict[str, Any], path: Path | None, *, as_json: bool) -> int:
    """Write the summary where asked, show it, and return the exit code: 0 completed, 1 aborted.

    Raises:
        FileError: when the file cannot be written; the summary has been shown nevertheless.
    """
    from uasfly.flight.summary import write_summary

    try:
        if path is not None:
            write_summary(summary, path)
    finally:
        if as_json:
            print(json.dumps(summary, indent=2))
        else:
            if any(check["verdict"] == "stop" for check in summary["preflight"]):
                Console().print(preflight_table(summary["preflight"]))
            Console().print(summary_table(summary))
    return 0 if summary["outcome"] == "completed" else 1


def preflight_table(checks: list[dict[str, str]]) -> Table:
    """The lines of a preflight check: verdict, value, why it matters, what to do."""
    table = Table(title="Preflight")
    table.add_column("")
    table.add_column("check", no_wrap=True)
    table.add_column("value", ratio=2)
    table.add_column("why it matters → what to do", ratio=3)
    for check in checks:
        style = _VERDICT_STYLES[check["verdict"]]
        why = Text(check["why"])
        if check["remedy"]:
            why.append(f"\n→ {check['remedy']}", style=style)
        table.add_row(Text(check["verdict"], style=style), Text(check["name"]), Text(check["value"]), why)
    return table


def summary_table(summary: dict[str, Any]) -> Table:
    """The summary as a table that reads in a terminal of 80 columns."""
    scenario = summary["scenario"] or "real vehicle"
    title = escape(f"{summary['mission']} · {summary['airframe']} · {scenario}")
    table = Table(title=title, show_header=False)
    table.add_column(style="bold")
    table.add_column()
    outcome = summary["outcome"]
    colour = "green" if outcome == "completed" else "red"
    reason = f": {escape(summary['reason'])}" if summary["reason"] else ""
    table.add_row("outcome", f"[{colour}]{outcome}[/]{reason}")
    table.add_row("duration", f"{summary['duration_s']:.1f} s, {summary['real_time_factor']} times real time")
    table.add_row(f"tracking RMS (against {summary['tracking_against']})", _axes(summary["tracking_rms_m"]))
    if summary["tracking_max_m"] is not None:
        table.add_row("tracking, at worst", f"{summary['tracking_max_m'] * 100:.1f} cm")
    if summary["estimate_rms_m"] is not None:
        table.add_row("estimate RMS error", _axes(summary["estimate_rms_m"]))
    if summary["gnss_rms_m"] is not None:
        table.add_row("position sensor RMS error", _axes(summary["gnss_rms_m"]))
    force = summary["force_m_s2"]
    table.add_row("mean wind force e/n/u", f"{force[0]:+.2f} {force[1]:+.2f} {force[2]:+.2f} m/s²")
    if summary["wind"] is not None:
        table.add_row("wind", _wind(summary["wind"]))
    table.add_row("solver", _times(summary["solve_ms"]))
    table.add_row("whole cycle", _times(summary["cycle_ms"]))
    if summary["latency_ms"] is not None:
        table.add_row("motion to setpoint", _times(summary["latency_ms"]))
    gap = summary["setpoint_gap_max_s"]
    if gap is not None:
        table.add_row("setpoints", f"{summary['setpoint_rate_hz']:.1f} Hz, largest gap {gap * 1e3:.0f} ms")
    table.add_row("fallback steps", str(summary["fallback_steps"]))
    table.add_row("rejected measurements", ", ".join(f"{k} {v}" for k, v in summary["rejected"].items()) or "none")
    for warning in summary["warnings"]:
        table.add_row("[yellow]warning[/]", escape(warning))
    return table


def _wind(wind: dict[str, float | None]) -> str:
    origin = "" if wind["from_deg"] is None else f" from {wind['from_deg']:.0f}°"
    return (
        f"{wind['mean_m_s']:.1f} ± {wind['sigma_m_s']:.1f} m/s{origin}, gusts {wind['gust_m_s']:.1f} m/s; "
        f"can be held: {wind['holdable_m_s']:.0f} m/s"
    )


def _axes(values: dict[str, float] | None) -> str:
    if values is None:
        return "not measured"
    x, y, z, total = (values[key] * 100.0 for key in ("x", "y", "z", "total"))
    return f"{total:.1f} cm (x {x:.1f}, y {y:.1f}, z {z:.1f})"


def _times(values: dict[str, float] | None) -> str:
    if values is None:
        return "not measured"
    return f"median {values['median']:.2f} ms, p99 {values['p99']:.2f} ms, max {values['max']:.2f} ms"
