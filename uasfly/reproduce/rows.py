"""What reproducing a paper gives: figures beside the paper's, and pictures that are drawn when somebody wants them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from uasfly.messages import Array

SEEDS = 5  # flights that a mean is of: the seed that is asked for and the ones after it


@dataclass(frozen=True, slots=True)
class Row:
    """One figure.

    Attributes:
        experiment: which of the paper's experiments.
        quantity: what the figure is. unit: its unit; empty for ratios and counts.
        paper: the paper's figure; None where it gives no number.
        uasfly: the figure measured here.
        better: whether uasfly's is as good as the paper's or better; None where the paper gives no number.
        note: what has to be known to compare them.
    """

    experiment: str
    quantity: str
    unit: str
    paper: float | None
    uasfly: float
    better: bool | None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Reproduction:
    """All of one paper.

    Attributes:
        paper: its name on the command line, as "asignacion2022".
        rows: the figures, in the paper's order.
        pictures: file stem -> draws the picture (PNG) to a path; nothing is drawn unless asked for.
    """

    paper: str
    rows: tuple[Row, ...]
    pictures: Mapping[str, Callable[[Path], None]]


Progress = Callable[[str, float], None]  # what is being flown, share done 0..1


def mean_row(
    experiment: str,
    quantity: str,
    unit: str,
    paper: float | None,
    values: Sequence[float] | Array,
    note: str,
    *,
    accepts: Callable[[float, float], bool] = lambda ours, theirs: ours <= theirs,
) -> Row:
    """A row of the flights' mean; the note begins with their spread.

    Args:
        experiment: see `Row`.
        quantity: see `Row`.
        unit: see `Row`.
        paper: the paper's figure, None where it gives none.
        values: one a flight.
        note: what has to be known to compare.
        accepts: whether uasfly's (first) is as good as the paper's.
    """
    figures = np.asarray(values, dtype=np.float64)
    mean = float(figures.mean())
    better = None if paper is None else accepts(mean, paper)
    texts = (_spread(figures), note)
    return Row(experiment, quantity, unit, paper, mean, better, "; ".join(text for text in texts if text))


def _spread(values: Array) -> str:
    if len(values) == 1:
        return "one flight"
    low, high, sigma = values.min(), values.max(), values.std(ddof=1)
    return f"{len(values)} flights, sd {sigma:.2g}, {low:.3g} to {high:.3g}"


def holds_in(values: Sequence[float] | Array, holds: Callable[[float], bool]) -> str:
    """How often something holds: "in 4 of 5 flights"."""
    figures = [float(value) for value in values]
    return f"in {sum(holds(value) for value in figures)} of {len(figures)} flights"
