"""What the reproduction of a paper gives: rows of figures, and pictures that are drawn when asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of a paper, and what uasfly reaches in its place."""

    experiment: str
    quantity: str
    unit: str
    paper: float | None  # None where the paper gives no number
    uasfly: float
    better: bool | None  # None where the paper gives no number
    note: str = ""


@dataclass(frozen=True, slots=True)
class Reproduction:
    """All of one paper."""

    paper: str
    rows: tuple[Row, ...]
    pictures: Mapping[str, Callable[[Path], None]]  # file stem -> draws it to that path (png), when asked for


Progress = Callable[[str, float], None]  # what is being flown, share done 0..1
