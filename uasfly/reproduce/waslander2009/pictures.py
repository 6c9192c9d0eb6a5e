"""Pictures like the paper's: position against time, wind estimated and true, paths."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from uasfly.reproduce.waslander2009.flight import Record

DOTS_PER_INCH = 120
_COLOURS = ("#c23b3b", "#e0762a", "#2f6fd0", "#2f9e5a")
_TRUE = "#5b6470"


def positions(flights: Mapping[str, Record], path: Path) -> None:
    """Deviation from the reference against time, an axis a panel."""
    figure, panels = _figure(3, 7.0)
    for axis, panel in enumerate(panels):
        for colour, (title, record) in zip(_COLOURS, flights.items(), strict=False):
            panel.plot(record.time_s, record.error[:, axis], color=colour, label=title, linewidth=1.2)
        panel.set_ylabel(f"{'xyz'[axis]} [m]")
    panels[0].set_title("Hover in the paper's wind: true position minus (0, 0, 2)")
    _legend(figure, panels[0])
    panels[-1].set_xlabel("time [s]")
    _save(figure, path)


def winds(record: Record, sensors: str, path: Path) -> None:
    """Wind, true and estimated, an axis a panel."""
    figure, panels = _figure(3, 7.0)
    shown = {"inverted": "inversion, bias untreated", "filtered": "filter with bias"}
    for axis, panel in enumerate(panels):
        panel.plot(record.time_s, record.wind[:, axis], color=_TRUE, linewidth=2.0, label="true")
        for colour, (kind, title) in zip(_COLOURS[::2], shown.items(), strict=True):
            estimate = record.estimates[sensors][kind][:, axis]
            panel.plot(record.time_s, estimate, color=colour, linewidth=1.2, label=title)
        panel.set_ylabel(f"{'xyz'[axis]} [m/s]")
    panels[0].set_title("Wind at the vehicle, from accelerometers")
    _legend(figure, panels[0])
    panels[-1].set_xlabel("time [s]")
    _save(figure, path)


def paths(flights: Mapping[str, Record], path: Path) -> None:
    """Seen from above."""
    figure, (panel,) = _figure(1, 6.0)
    reference = next(iter(flights.values())).reference
    panel.plot(reference[:, 0], reference[:, 1], color=_TRUE, linewidth=2.5, alpha=0.5, label="reference")
    for colour, (title, record) in zip(_COLOURS, flights.items(), strict=False):
        panel.plot(record.position[:, 0], record.position[:, 1], color=colour, linewidth=1.2, label=title)
    spread = float(np.ptp(reference[:, 1]))
    if spread > 0.5:
        panel.set_aspect("equal")
    panel.set_xlabel("x [m]")
    panel.set_ylabel("y [m]")
    _legend(figure, panel)
    _save(figure, path)


def _figure(panels: int, height_inches: float) -> tuple[Any, tuple[Any, ...]]:
    """A figure without pyplot, which keeps state and may want a display."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, height_inches), layout="constrained")
    axes = tuple(np.atleast_1d(figure.subplots(panels, sharex=True)).tolist())
    for one in axes:
        one.grid(True, color="#dddddd", linewidth=0.8)
        one.set_axisbelow(True)
        for side in ("top", "right"):
            one.spines[side].set_visible(False)
    return figure, axes


def _legend(figure: Any, panel: Any) -> None:
    """Below the panels, where it hides nothing."""
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)


def _save(figure: Any, path: Path) -> None:
    figure.savefig(path, dpi=DOTS_PER_INCH, metadata={"Software": None})
