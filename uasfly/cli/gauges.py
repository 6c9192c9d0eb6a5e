"""Arrow, bar and numbers of the live view; whatever is not known or not finite has a picture too."""

from __future__ import annotations

import math
from functools import lru_cache

from uasfly.cli.big_text import HALVES

GREEN, YELLOW, RED = "green", "yellow", "red"
UNKNOWN = "–"
CALM_M_S2 = 0.05  # a weaker force has no direction but its noise
ARROW_ROWS = 5
_PIXELS = 2 * ARROW_ROWS
_SMALL_ARROWS = "→↗↑↖←↙↓↘"
_POINTS = ("E", "NE", "N", "NW", "W", "SW", "S", "SE")
_STEPS = 24  # directions of the large arrow


def number(value: float, form: str, *, width: int = 0) -> str:
    """A number in a format, right-aligned; a dash for what is not finite."""
    return (format(value, form) if math.isfinite(value) else UNKNOWN).rjust(width)


def graded(value: float, good: float, fair: float) -> str:
    """Colour of a value of which less is better: green below `good`, yellow below `fair`, red above or unknown."""
    return GREEN if value < good else YELLOW if value < fair else RED


def length(vector: list[float]) -> float:
    """Length of a vector given as a list."""
    return math.sqrt(math.fsum(v * v for v in vector)) if all(map(math.isfinite, vector)) else math.nan


def bar(share: float, width: int) -> tuple[str, str]:
    """Filled and empty part of a bar; empty where the share is unknown."""
    filled = round(width * min(max(share, 0.0), 1.0)) if math.isfinite(share) else 0
    return "█" * filled, "░" * (width - filled)


def small_arrow(east: float, north: float) -> str:
    """Where a vector points on a map (north up), in one character."""
    return _SMALL_ARROWS[_eighth(east, north)] if _points(east, north) else "·"


def point_of_compass(east: float, north: float) -> str:
    """Where a vector points, in letters."""
    return f"to {_POINTS[_eighth(east, north)]}" if _points(east, north) else ""


def large_arrow(east: float, north: float) -> tuple[str, ...]:
    """Where a vector points on a map (north up), ARROW_ROWS rows of twice as many columns."""
    if not _points(east, north):
        return _arrow(None)
    return _arrow(round(math.atan2(north, east) / (math.tau / _STEPS)) % _STEPS)


def _points(east: float, north: float) -> bool:
    size = math.hypot(east, north)
    return math.isfinite(size) and size > CALM_M_S2


def _eighth(east: float, north: float) -> int:
    return round(math.atan2(north, east) / (math.pi / 4.0)) % 8


@lru_cache(maxsize=_STEPS + 1)
def _arrow(step: int | None) -> tuple[str, ...]:
    """Half blocks are square: ten columns and five rows make ten by ten pixels."""
    pixels = [[_inside(step, x, y) for x in range(_PIXELS)] for y in range(_PIXELS)]
    pairs = zip(pixels[::2], pixels[1::2], strict=True)
    return tuple("".join(HALVES[a, b] for a, b in zip(*pair, strict=True)) for pair in pairs)


def _inside(step: int | None, column: int, row: int) -> bool:
    """Whether a pixel's middle lies in the arrow: a shaft and a triangular head; a dot without a direction."""
    x, y = column + 0.5 - _PIXELS / 2, _PIXELS / 2 - row - 0.5
    if step is None:
        return math.hypot(x, y) < 1.0
    angle = step * math.tau / _STEPS
    along, across = x * math.cos(angle) + y * math.sin(angle), abs(y * math.cos(angle) - x * math.sin(angle))
    return (-5.0 <= along <= 0.5 and across < 1.05) or (0.0 < along < 5.2 and across < 0.85 * (5.2 - along))
