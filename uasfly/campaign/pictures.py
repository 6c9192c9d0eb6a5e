"""Pictures of a campaign: RMS boxes, success rate against wind, the worst flights."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from uasfly.campaign.statistics import completed_rms, grouped, label, wilson, worst
from uasfly.campaign.table import Row
from uasfly.plotting import quiet_figure, save

MOST_BOXES = 30
MOST_LINES = 8
WORST_FLIGHTS = 15
SPREAD = 0.15  # of a box's height: how far the points of single flights lie apart
_COLOURS = ("#2f6fd0", "#e0762a", "#2f9e5a", "#c23b3b", "#7d55c7", "#8a6d3b", "#d05fa6", "#5b6470")
_OUTCOMES = {"completed": _COLOURS[0], "aborted": _COLOURS[3], "error": _COLOURS[7]}


def rms_boxes(rows: Sequence[Row], swept: Sequence[str], path: Path) -> None:
    """A box a group: median, quartiles, whiskers to 1.5 times the box, and every flight as a point."""
    groups = grouped(rows, swept)
    among = [what for what, _ in groups]
    boxes = [
        (f"{label(what, among)} (n={len(values)})", values)
        for what, members in groups
        if (values := [100.0 * value for value in completed_rms(members)])
    ]
    title = "Tracking RMS of completed flights (line: median, box: middle half, points: flights)"
    if len(boxes) > MOST_BOXES:
        title += f"\nthe {MOST_BOXES} of {len(boxes)} groups with the worst flights"
        least = sorted((max(values) for _, values in boxes), reverse=True)[MOST_BOXES - 1]
        boxes = [box for box in boxes if max(box[1]) >= least][:MOST_BOXES]
    figure, axes = _figure(0.42 * len(boxes))
    axes.set_title(title)
    if not boxes:
        _nothing(axes, "no flight was completed")
    else:
        places = list(range(len(boxes), 0, -1))
        axes.boxplot(
            [values for _, values in boxes],
            positions=places,
            orientation="horizontal",
            widths=0.6,
            showfliers=False,
            patch_artist=True,
            boxprops={"facecolor": "#dbe7f8", "edgecolor": _COLOURS[0]},
            medianprops={"color": _COLOURS[3], "linewidth": 2},
            whiskerprops={"color": _COLOURS[0]},
            capprops={"color": _COLOURS[0]},
        )
        for place, (_, values) in zip(places, boxes, strict=True):
            heights = [place + SPREAD * ((k * 7) % 11 - 5) / 5 for k in range(len(values))]  # spread, always alike
            axes.plot(values, heights, ".", color=_COLOURS[7], alpha=0.5, markersize=4)
        axes.set_yticks(places, [name for name, _ in boxes])
        axes.set_ylim(0.4, len(boxes) + 0.6)
        axes.set_xlim(left=0.0)
    axes.set_xlabel("RMS of position, truth minus reference [cm]")
    save(figure, path)


def success_against_wind(rows: Sequence[Row], path: Path) -> None:
    """Share of successes at every wind speed, with its 95 % interval; a line for each vehicle, mission, controller."""
    lines: dict[tuple[str, str, str], dict[float, list[bool]]] = {}
    for row in rows:
        line = lines.setdefault((row["airframe"], row["mission"], row["controller"]), {})
        line.setdefault(row["wind_m_s"], []).append(row["success"])
    winds = sorted({row["wind_m_s"] for row in rows})
    steps = [after - before for before, after in itertools.pairwise(winds)]
    aside = 0.06 * min(steps, default=1.0)
    shown = list(lines.items())[:MOST_LINES]
    among = [dict(zip(("airframe", "mission", "controller"), key, strict=True)) for key in lines]
    figure, axes = _figure(3.4)
    more = f" (first {MOST_LINES} of {len(lines)})" if len(lines) > MOST_LINES else ""
    axes.set_title(f"Success rate against wind, 95 % intervals{more}")
    for number, (key, by_wind) in enumerate(shown):
        speeds = sorted(by_wind)
        rates = [100.0 * sum(by_wind[speed]) / len(by_wind[speed]) for speed in speeds]
        bounds = [wilson(sum(by_wind[speed]), len(by_wind[speed])) for speed in speeds]
        below = [rate - 100.0 * low for rate, (low, _) in zip(rates, bounds, strict=True)]
        above = [100.0 * high - rate for rate, (_, high) in zip(rates, bounds, strict=True)]
        places = [speed + aside * (number - (len(shown) - 1) / 2.0) for speed in speeds]
        what = dict(zip(("airframe", "mission", "controller"), key, strict=True))
        name = label(what, among)
        axes.errorbar(places, rates, [below, above], fmt="o-", capsize=4, color=_COLOURS[number], label=name)
    counts = {len(flown) for _, by_wind in shown for flown in by_wind.values()}
    axes.set_ylim(-3.0, 103.0)
    axes.set_ylabel("successful flights [%]")
    flights = f"{min(counts)} to {max(counts)}" if len(counts) > 1 else f"{min(counts)}"
    axes.set_xlabel(
        f"mean wind of the scenario (at 10 m; jets: on the axis at their aim) [m/s], {flights} flights a point"
    )
    axes.legend(loc="best", framealpha=0.9)
    save(figure, path)


def worst_flights(rows: Sequence[Row], swept: Sequence[str], path: Path) -> None:
    """The worst flights as bars: RMS, and how far the vehicle was away at most."""
    chosen = worst(rows, WORST_FLIGHTS)[::-1]
    among = [what for what, _ in grouped(rows, swept)]
    figure, axes = _figure(0.36 * len(chosen))
    axes.set_title(f"The {len(chosen)} worst of {len(rows)} flights")
    places = range(len(chosen))
    rms = [100.0 * (row["tracking_rms_m"] or 0.0) for row in chosen]
    largest = [100.0 * (row["tracking_max_m"] or 0.0) for row in chosen]
    axes.barh(places, rms, height=0.65, color=[_OUTCOMES[row["outcome"]] for row in chosen])
    axes.plot(largest, places, "|", color="black", markersize=11, markeredgewidth=1.5)
    names = []
    for row in chosen:
        what = {name: row[name] for name in among[0]}
        aborted = "" if row["outcome"] == "completed" else f" — {row['outcome']}"
        names.append(f"#{row['index']} {label(what, among)}, seed {row['seed']}{aborted}")
    axes.set_yticks(list(places), names)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("position error, truth minus reference [cm]")
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    present = {row["outcome"] for row in chosen}
    handles: list[Any] = [Patch(color=c, label=f"RMS, {name}") for name, c in _OUTCOMES.items() if name in present]
    handles.append(Line2D([], [], marker="|", color="black", linestyle="", markersize=11, label="largest error"))
    axes.legend(handles=handles, loc="lower right", framealpha=0.9)
    save(figure, path)


def _figure(height_inches: float) -> tuple[Any, Any]:
    figure, panels = quiet_figure(1, 1, (9.0, 1.4 + max(1.2, height_inches)))
    return figure, panels[0, 0]


def _nothing(axes: Any, text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes)
    axes.set_yticks([])
