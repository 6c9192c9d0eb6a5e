"""Pictures like the paper's: estimate beside GNSS and truth, disturbances, positions, spirals, and errors as boxes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from uasfly.messages import Array
from uasfly.plotting import legend_below, quiet_figure, save, spatial_figure
from uasfly.reproduce.kalaitzakis2023.flight import Record

_TRUE, _ESTIMATE, _GNSS, _WANTED, _PAPER = "#5b6470", "#2f6fd0", "#e0762a", "#2f9e5a", "#c23b3b"
_TOGETHER = 5  # cycles to a point of a path
_RATIO = (1.0, 1.0, 0.8)


def localisation(record: Record, title: str, path: Path) -> None:
    """Position against time, an axis a panel: what GNSS says, the estimate, the truth."""
    figure, grid = quiet_figure(3, 1, (9.0, 7.0), share_x=True)
    panels = grid[:, 0]
    for axis, panel in enumerate(panels):
        for values, colour, label, width in (
            (record.gnss, _GNSS, "GNSS", 0.8),
            (record.truth, _TRUE, "true", 2.0),
            (record.estimate, _ESTIMATE, "estimate", 1.0),
        ):
            panel.plot(record.since_start_s, values[:, axis], color=colour, linewidth=width, label=label)
        panel.set_ylabel(f"{'xyz'[axis]} [m]")
    panels[0].set_title(title)
    panels[-1].set_xlabel("time [s]")
    legend_below(figure, panels[0])
    save(figure, path)


def positions(record: Record, title: str, path: Path) -> None:
    """Position against time, an axis a panel: wanted and true; as seen from the marker where there is one."""
    figure, grid = quiet_figure(3, 1, (9.0, 7.0), share_x=True)
    panels = grid[:, 0]
    true = record.reference + record.error
    for axis, panel in enumerate(panels):
        panel.plot(record.since_start_s, record.reference[:, axis], color=_WANTED, linewidth=1.8, label="wanted")
        panel.plot(record.since_start_s, true[:, axis], color=_ESTIMATE, linewidth=1.0, label="true")
        panel.set_ylabel(f"{'xyz'[axis]} [m]")
        middle = 0.5 * (true[:, axis].min() + true[:, axis].max())
        half = max(0.25, 0.55 * float(np.ptp(true[:, axis])))  # millimetres are not to look like metres
        panel.set_ylim(middle - half, middle + half)
    panels[0].set_title(title)
    panels[-1].set_xlabel("time [s]")
    legend_below(figure, panels[0])
    save(figure, path)


def forces(record: Record, papers: Sequence[tuple[int, float, float, float]], path: Path) -> None:
    """Disturbance against time, an axis a panel: true, estimated, and the paper's figures.

    Args:
        record: of the hover before a blower.
        papers: axis, from and to [s, on the stop watch that starts with offboard], the paper's force [m/s^2].
        path: of the picture.
    """
    figure, grid = quiet_figure(3, 1, (9.0, 7.0), share_x=True)
    panels = grid[:, 0]
    since = record.time_s - record.offboard_s
    for axis, panel in enumerate(panels):
        panel.plot(since, record.force_true[:, axis], color=_TRUE, linewidth=0.8, alpha=0.6, label="true")
        panel.plot(since, record.force_estimated[:, axis], color=_ESTIMATE, linewidth=1.2, label="estimate")
        for number, (its_axis, begin_s, end_s, force) in enumerate(papers):
            label = "paper" if number == 0 else "_"
            if its_axis == axis:
                panel.hlines(force, begin_s, end_s, color=_PAPER, linewidth=2.0, label=label)
        panel.set_ylabel(f"{'xyz'[axis]} [m/s²]")
    panels[0].set_title("Hover before a blower: disturbance, mass-normalised")
    panels[-1].set_xlabel("time since offboard [s]")
    legend_below(figure, panels[0])
    save(figure, path)


def paths(flights: Mapping[str, Record], path: Path) -> None:
    """Paths in space, a panel each: wanted and flown."""
    columns = 2
    figure, panels = spatial_figure(-(-len(flights) // columns), columns, (10.0, 9.0))
    for panel, (title, record) in zip(panels.flat, flights.items(), strict=False):
        for values, colour, label, width in (
            (record.reference, _WANTED, "wanted", 2.0),
            (record.truth, _ESTIMATE, "true", 1.0),
        ):
            panel.plot(*values[::_TOGETHER].T, color=colour, linewidth=width, label=label)
        panel.set_title(title)
        panel.set_box_aspect(_RATIO)
        panel.locator_params(nbins=5)
        for letter in "xyz":
            getattr(panel, f"set_{letter}label")(f"{letter} [m]")
    legend_below(figure, panels.flat[0])
    save(figure, path)


def boxes(flights: Mapping[str, tuple[Sequence[Record], float]], path: Path) -> None:
    """Distance from the reference over all flights of an experiment, a box each, with the paper's RMS.

    Args:
        flights: by title: flights, and the paper's figure [cm].
        path: of the picture.
    """
    figure, ((panel,),) = quiet_figure(1, 1, (9.0, 6.0))
    errors = [100.0 * np.concatenate([_distances(record) for record in some]) for some, _ in flights.values()]
    places = np.arange(len(errors), 0, -1)
    panel.boxplot(errors, positions=places, orientation="horizontal", whis=(0, 95), showfliers=False, widths=0.5)
    rms = [float(np.sqrt((error**2).mean())) for error in errors]
    panel.plot(rms, places, "o", color=_ESTIMATE, label="RMS")
    panel.plot([paper for _, paper in flights.values()], places, "D", color=_PAPER, label="RMS of the paper")
    panel.set_yticks(places, list(flights))
    panel.set_xlim(left=0.0)
    panel.set_xlabel("distance from the reference [cm]; whiskers to 95 %")
    legend_below(figure, panel)
    save(figure, path)


def _distances(record: Record) -> Array:
    return np.asarray(np.linalg.norm(record.error, axis=1))
