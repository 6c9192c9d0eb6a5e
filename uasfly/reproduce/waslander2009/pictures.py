"""Pictures like the paper's: position against time, wind estimated and true, paths."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from uasfly.plotting import legend_below, quiet_figure, save
from uasfly.reproduce.waslander2009.flight import Record

_COLOURS = ("#c23b3b", "#e0762a", "#2f6fd0", "#2f9e5a")
_TRUE = "#5b6470"


def positions(flights: Mapping[str, Record], path: Path) -> None:
    """Deviation from the reference against time, an axis a panel."""
    figure, grid = quiet_figure(3, 1, (9.0, 7.0), share_x=True)
    panels = grid[:, 0]
    for axis, panel in enumerate(panels):
        for colour, (title, record) in zip(_COLOURS, flights.items(), strict=False):
            panel.plot(record.time_s, record.error[:, axis], color=colour, label=title, linewidth=1.2)
        panel.set_ylabel(f"{'xyz'[axis]} [m]")
    panels[0].set_title("Hover in the paper's wind: true position minus (0, 0, 2)")
    legend_below(figure, panels[0])
    panels[-1].set_xlabel("time [s]")
    save(figure, path)


def winds(record: Record, sensors: str, path: Path) -> None:
    """Wind, true and estimated, an axis a panel."""
    figure, grid = quiet_figure(3, 1, (9.0, 7.0), share_x=True)
    panels = grid[:, 0]
    shown = {"inverted": "inversion, bias untreated", "filtered": "filter with bias"}
    for axis, panel in enumerate(panels):
        panel.plot(record.time_s, record.wind[:, axis], color=_TRUE, linewidth=2.0, label="true")
        for colour, (kind, title) in zip(_COLOURS[::2], shown.items(), strict=True):
            estimate = record.estimates[sensors][kind][:, axis]
            panel.plot(record.time_s, estimate, color=colour, linewidth=1.2, label=title)
        panel.set_ylabel(f"{'xyz'[axis]} [m/s]")
    panels[0].set_title("Wind at the vehicle, from accelerometers")
    legend_below(figure, panels[0])
    panels[-1].set_xlabel("time [s]")
    save(figure, path)


def paths(flights: Mapping[str, Record], path: Path) -> None:
    """Seen from above."""
    figure, ((panel,),) = quiet_figure(1, 1, (9.0, 6.0))
    reference = next(iter(flights.values())).reference
    panel.plot(reference[:, 0], reference[:, 1], color=_TRUE, linewidth=2.5, alpha=0.5, label="reference")
    for colour, (title, record) in zip(_COLOURS, flights.items(), strict=False):
        panel.plot(record.position[:, 0], record.position[:, 1], color=colour, linewidth=1.2, label=title)
    spread = float(np.ptp(reference[:, 1]))
    if spread > 0.5:
        panel.set_aspect("equal")
    panel.set_xlabel("x [m]")
    panel.set_ylabel("y [m]")
    legend_below(figure, panel)
    save(figure, path)
