"""Rows of styled text, boxes around them and boxes side by side.

Rich's own tables and panels measure and wrap their content anew with every drawing, which takes several times as long;
the live view shares its process with the control loop, and its widths are known beforehand.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style

Row = list[Segment]
FRAME = "dim"
_TAIL = "…"


def row(*parts: str | tuple[str, str]) -> Row:
    """A row of texts, each by itself or with its style."""
    pairs = ((part, "") if isinstance(part, str) else part for part in parts)
    return [Segment(printable(text), Style.parse(style)) for text, style in pairs]


def printable(text: str) -> str:
    """A text without control characters: a vehicle's or a file's must not move the cursor."""
    return text if text.isprintable() else "".join(c if c.isprintable() else " " for c in text)


def fit(content: Row, width: int) -> Row:
    """A row cut or filled up to a width; what is cut ends in an ellipsis."""
    excess = Segment.get_line_length(content) - width
    if excess <= 0 or width <= 0:
        return Segment.adjust_line_length(content, max(0, width))
    cut = Segment.adjust_line_length(content, width - 1)
    return [*cut, Segment(_TAIL, cut[-1].style if cut else None)]


def spread(left: Row, right: Row, width: int) -> Row:
    """A row with something at both ends; the left end is cut where there is not room for both."""
    room = width - Segment.get_line_length(right)
    return fit([*fit(left, room), *right], width)


def box(title: str, rows: Iterable[Row], width: int) -> list[Row]:
    """Rows in a frame with a title; `width` is the frame's."""
    inner = width - 4
    line = "─" * max(0, width - 5 - cell_len(title))
    framed = [fit(row(("╭─ ", FRAME), (title, "bold"), (f" {line}╮", FRAME)), width)]
    framed += [[*row(("│ ", FRAME)), *fit(content, inner), *row((" │", FRAME))] for content in rows]
    framed.append(row((f"╰{'─' * (width - 2)}╯", FRAME)))
    return framed


def rule(title: str, width: int) -> Row:
    """A line across with a title in it."""
    line = "─" * max(0, width - 4 - cell_len(title))
    return fit(row(("── ", FRAME), (title, "bold"), (f" {line}", FRAME)), width)


def beside(*blocks: Sequence[Row]) -> list[Row]:
    """Blocks of as many rows each, side by side."""
    return [[segment for part in parts for segment in part] for parts in zip(*blocks, strict=True)]
