"""What reproducing a paper gives: figures beside the paper's, and pictures that are drawn when somebody wants them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path


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
