"""Printed markers: a sheet in millimetres, cut into pages where it is larger than the paper.

A sheet is a marker with its white margin, or a whole flat bundle. Where it does not fit on the printable part of a page
it is tiled; every page has cut marks at its tile's corners, its place on the sheet, ids and sizes, and a ruler of
100 mm, because printers scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from uasfly.bundle import Bundle, BundleMarker
from uasfly.errors import UasflyError
from uasfly.messages import Array

Paper = Literal["a4", "a3", "letter"]
PAPERS_MM: dict[str, tuple[float, float]] = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
MARGIN_MM = 10.0  # printers leave this much white
FOOT_MM = 22.0  # ruler and text
RULER_MM = 100.0


@dataclass(frozen=True, slots=True)
class Square:
    """A black square of a sheet: left and lower edge, and side [mm]."""

    x: float
    y: float
    side: float


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is to be printed in one piece.

    Attributes:
        title: ids and sizes, for people.
        width_mm, height_mm: white margin included.
        squares: black cells, origin at the lower left.
    """

    title: str
    width_mm: float
    height_mm: float
    squares: tuple[Square, ...]


@dataclass(frozen=True, slots=True)
class Page:
    """One page: the part of a sheet from (x, y), width by height [mm], put at the page's (left, bottom).

    Attributes:
        row, column: of the tile, from the top left. rows, columns: how many the sheet has.
    """

    sheet: Sheet
    x: float
    y: float
    width: float
    height: float
    left: float
    bottom: float
    row: int
    column: int
    rows: int
    columns: int


def marker_cells(bundle: Bundle, marker_id: int) -> Array:
    """Cells (n, n) of a marker with its border, 1 where black, row 0 at the top.

    Raises:
        UasflyError: the family cannot be drawn, or has no such id.
    """
    import cv2

    from uasfly.vision.opencv_detector import dictionary_of

    if bundle.family.startswith("stag"):
        raise UasflyError(f"markers {bundle.family}: STag markers come as pictures from their makers; print those")
    dictionary = dictionary_of(bundle.family)
    if marker_id >= len(dictionary.bytesList):
        last = len(dictionary.bytesList) - 1
        raise UasflyError(f"markers {bundle.family}: expected an id from 0 to {last}, found {marker_id}")
    cells = dictionary.markerSize + 2
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, marker_id, cells) < 128, dtype=float)


def marker_sheets(bundle: Bundle) -> list[Sheet]:
    """A sheet for each marker."""
    sheets = []
    for marker in bundle.markers:
        cells = marker_cells(bundle, marker.id)
        side = marker.size_m * 1000.0
        edge = side / len(cells)
        title = f"{bundle.family} id {marker.id}, {side:g} mm"
        sheets.append(Sheet(title, side + 2 * edge, side + 2 * edge, _squares(cells, edge, edge, edge)))
    return sheets


def bundle_sheet(bundle: Bundle) -> Sheet:
    """The whole bundle on one sheet.

    Raises:
        UasflyError: it is not flat, or a marker is turned.
    """
    for marker in bundle.markers:
        if abs(marker.position_m[2]) > 1e-6 or not np.allclose(marker.rotation, np.eye(3)):
            problem = f"marker {marker.id} is turned or not in the plane z = 0"
            raise UasflyError(f"bundle {bundle.name}: {problem}; print its markers one by one")
    boxes = [(_left(m), _low(m), m.size_m * 1000.0) for m in bundle.markers]
    edge = max(side / len(marker_cells(bundle, m.id)) for m, (_, _, side) in zip(bundle.markers, boxes, strict=True))
    left, low = min(x for x, _, _ in boxes) - edge, min(y for _, y, _ in boxes) - edge
    right, top = max(x + s for x, _, s in boxes) + edge, max(y + s for _, y, s in boxes) + edge
    squares: list[Square] = []
    for marker, (x, y, side) in zip(bundle.markers, boxes, strict=True):
        cells = marker_cells(bundle, marker.id)
        squares += _squares(cells, side / len(cells), x - left, y - low)
    sizes = sorted({f"{side:g}" for _, _, side in boxes})
    ids = ", ".join(str(marker.id) for marker in bundle.markers)
    title = f"{bundle.name}: {bundle.family} ids {ids}, {' and '.join(sizes)} mm"
    return Sheet(title, right - left, top - low, tuple(squares))


def pages_of(sheets: list[Sheet], paper: Paper) -> list[Page]:
    """Pages of the sheets, tiled where they do not fit."""
    page_width, page_height = PAPERS_MM[paper]
    width, height = page_width - 2 * MARGIN_MM, page_height - 2 * MARGIN_MM - FOOT_MM
    pages: list[Page] = []
    for sheet in sheets:
        columns, rows = math.ceil(sheet.width_mm / width - 1e-9), math.ceil(sheet.height_mm / height - 1e-9)
        tile = (sheet.width_mm / columns, sheet.height_mm / rows)
        left, bottom = 0.5 * (page_width - tile[0]), MARGIN_MM + FOOT_MM + 0.5 * (height - tile[1])
        pages += [
            Page(sheet, column * tile[0], (rows - 1 - row) * tile[1], *tile, left, bottom, row, column, rows, columns)
            for row in range(rows)
            for column in range(columns)
        ]
    return pages


def _left(marker: BundleMarker) -> float:
    return (marker.position_m[0] - 0.5 * marker.size_m) * 1000.0


def _low(marker: BundleMarker) -> float:
    return (marker.position_m[1] - 0.5 * marker.size_m) * 1000.0


def _squares(cells: Array, edge: float, left: float, low: float) -> tuple[Square, ...]:
    count = len(cells)
    return tuple(
        Square(left + column * edge, low + (count - 1 - row) * edge, edge)
        for row in range(count)
        for column in range(count)
        if cells[row, column]
    )
