"""What all pictures of flights share: a figure with quiet axes, and how it is written. Needs matplotlib (an extra)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

DOTS_PER_INCH = 120


def quiet_figure(rows: int, columns: int, inches: tuple[float, float], *, share_x: bool = False) -> tuple[Any, Any]:
    """A figure and its axes (rows, columns), without pyplot, which keeps state and may want a display.

    Args:
        rows: of the axes.
        columns: of the axes.
        inches: width and height.
        share_x: whether axes above one another share their abscissa.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=share_x)
    for axes in panels.flat:
        axes.grid(True, color="#dddddd", linewidth=0.8)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    return figure, panels


def spatial_figure(rows: int, columns: int, inches: tuple[float, float]) -> tuple[Any, Any]:
    """A figure and its three-dimensional axes (rows, columns); arguments as with `quiet_figure`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "3d"})


def legend_below(figure: Any, panel: Any) -> None:
    """The legend of one of the panels below all of them, where it hides nothing."""
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)


def save(figure: Any, path: Path) -> None:
    """Write the picture (PNG); the same figure gives the same bytes."""
    figure.savefig(path, dpi=DOTS_PER_INCH, metadata={"Software": None})
