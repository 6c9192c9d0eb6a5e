"""Draws pages of markers to scale (extra `vision`): one unit of the drawing is a millimetre of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from uasfly.errors import UasflyError
from uasfly.vision.sheets import MARGIN_MM, PAPERS_MM, RULER_MM, Page, Paper

_MM_PER_INCH = 25.4
_CUT_MARK_MM = 5.0


def write_pdf(path: Path, pages: list[Page], paper: Paper) -> None:
    """Write the pages into one PDF.

    Raises:
        UasflyError: matplotlib is not installed.
        OSError: the file cannot be written.
    """
    _need_matplotlib()
    from matplotlib.backends.backend_pdf import PdfPages

    with PdfPages(path) as document:
        for number, page in enumerate(pages, 1):
            document.savefig(draw_page(page, paper, f"page {number} of {len(pages)}"))


def draw_page(page: Page, paper: Paper, number: str = "") -> Any:
    """A matplotlib figure of the paper's size.

    Raises:
        UasflyError: matplotlib is not installed.
    """
    _need_matplotlib()
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch, Rectangle
    from matplotlib.path import Path as Outline

    width, height = PAPERS_MM[paper]
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    axes.set_axis_off()
    vertices: list[tuple[float, float]] = []
    codes: list[Any] = []
    for square in page.sheet.squares:  # one path: cells that are drawn one by one have light seams between them
        x, y = square.x - page.x + page.left, square.y - page.y + page.bottom
        side = square.side
        vertices += [(x, y), (x + side, y), (x + side, y + side), (x, y + side), (x, y)]
        codes += [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY]
    window = Rectangle((page.left, page.bottom), page.width, page.height, transform=axes.transData)
    black = PathPatch(Outline(vertices, codes), facecolor="black", edgecolor="none", linewidth=0.0)
    axes.add_patch(black)
    black.set_clip_path(window)
    for x, outwards_x in ((page.left, -1.0), (page.left + page.width, 1.0)):
        for y, outwards_y in ((page.bottom, -1.0), (page.bottom + page.height, 1.0)):
            axes.plot((x + outwards_x, x + outwards_x * _CUT_MARK_MM), (y, y), color="0.4", linewidth=0.5)
            axes.plot((x, x), (y + outwards_y, y + outwards_y * _CUT_MARK_MM), color="0.4", linewidth=0.5)
    _draw_ruler(axes)
    tile = (
        ""
        if page.rows * page.columns == 1
        else f", row {page.row + 1}/{page.rows} column {page.column + 1}/{page.columns}"
    )
    text = f"{page.sheet.title}{tile}  {number}"
    axes.text(MARGIN_MM, MARGIN_MM + 13.0, text, fontsize=8, color="0.2", va="bottom")
    return figure


def _draw_ruler(axes: Any) -> None:
    axes.plot((MARGIN_MM, MARGIN_MM + RULER_MM), (MARGIN_MM + 6.0,) * 2, color="black", linewidth=0.5)
    for mark in range(int(RULER_MM) + 1):
        length = 4.0 if mark % 10 == 0 else 2.5 if mark % 5 == 0 else 1.5
        x = MARGIN_MM + mark
        axes.plot((x, x), (MARGIN_MM + 6.0, MARGIN_MM + 6.0 + length), color="black", linewidth=0.3)
    words = f"{RULER_MM:g} mm: measure it. Print at 100 %, without fitting to the page."
    axes.text(MARGIN_MM, MARGIN_MM, words, fontsize=7, color="0.2", va="bottom")


def _need_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        problem = "printing markers needs matplotlib; install it (pip install 'uasfly[vision]')"
        raise UasflyError(problem) from None
