"""Makes Rich's SVG look the same with every font: blocks and frames become shapes, each word is placed by itself.

As text, rows of blocks stand apart or overlap, and columns shift, with the font that the reader's machine happens to
have.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from html import escape, unescape

CELL_WIDTH, CELL_HEIGHT = 12.2, 24.4  # of Rich's export
_BASELINE = 20.0  # below the cell's top
_TOP = 1.5
_CRISP = ' shape-rendering="crispEdges"'  # so that no seam shows between rows
_LINE = 1.3  # width of a frame's line
_TEXT = re.compile(r'<text class="([^"]*)" x="([^"]*)" y="([^"]*)"[^>]*>([^<]*)</text>')
_WORD = re.compile(r"\S+")

# Which characters fill the upper, the lower half of their cell, the whole of it lightly, or carry a line across it.
_UPPER, _LOWER, _LIGHT, _ACROSS = "█▀", "█▄", "░", "─"
_CORNERS = {"╭": (0.5, 0.5), "╮": (0.0, 0.5), "╰": (0.5, 0.0), "╯": (0.0, 0.0)}  # left end, upper end of their lines
_DRAWN = set(" █▀▄░─│") | _CORNERS.keys()


def with_shapes(svg: str) -> str:
    """The SVG of Rich with blocks and frames as rectangles and the rest word by word."""
    return _TEXT.sub(_replaced, svg)


def _replaced(match: re.Match[str]) -> str:
    style, x, y, text = match.groups()
    text = unescape(text).replace("\xa0", " ")
    elements = _shapes if set(text) <= _DRAWN else _words
    return "".join(f"{element}\n" for element in elements(style, float(x), float(y), text))


def _words(style: str, left: float, baseline: float, text: str) -> Iterator[str]:
    for word in _WORD.finditer(text):
        x, length = left + CELL_WIDTH * word.start(), CELL_WIDTH * len(word[0])
        yield f'<text class="{style}" x="{x:.1f}" y="{baseline:.1f}" textLength="{length:.1f}">{escape(word[0])}</text>'


def _shapes(style: str, left: float, baseline: float, text: str) -> Iterator[str]:
    top = baseline - _BASELINE + _TOP
    half, thin = CELL_HEIGHT / 2, _LINE / 2

    def rectangle(column: float, y: float, columns: float, height: float, extra: str = "") -> str:
        x, width = left + CELL_WIDTH * column, CELL_WIDTH * columns
        return f'<rect class="{style}" x="{x:.2f}" y="{top + y:.2f}" width="{width:.2f}" height="{height:.2f}"{extra}/>'

    for first, count in _runs(text, _UPPER.__contains__):
        yield rectangle(first, 0.0, count, half, _CRISP)
    for first, count in _runs(text, _LOWER.__contains__):
        yield rectangle(first, half, count, half, _CRISP)
    for first, count in _runs(text, _LIGHT.__contains__):
        yield rectangle(first, 0.0, count, CELL_HEIGHT, _CRISP + ' fill-opacity="0.3"')
    for first, count in _runs(text, _ACROSS.__contains__):
        yield rectangle(first, half - thin, count, _LINE)
    for column, character in enumerate(text):
        if character == "│":
            yield rectangle(column + 0.5 - thin / CELL_WIDTH, 0.0, _LINE / CELL_WIDTH, CELL_HEIGHT)
        elif character in _CORNERS:
            from_left, from_top = _CORNERS[character]
            yield rectangle(column + from_left, half - thin, 0.5, _LINE)
            yield rectangle(column + 0.5 - thin / CELL_WIDTH, CELL_HEIGHT * from_top, _LINE / CELL_WIDTH, half + thin)


def _runs(text: str, belongs: Callable[[str], bool]) -> Iterator[tuple[int, int]]:
    """First column and length of each run of characters that belong."""
    for found, run in itertools.groupby(range(len(text)), key=lambda column: belongs(text[column])):
        columns = list(run)
        if found:
            yield columns[0], len(columns)
