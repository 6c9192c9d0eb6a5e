"""The ChArUco board: what a text says about it, its corners in a picture, and its squares for printing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from uasfly.bundle import Family
from uasfly.errors import UasflyError
from uasfly.file_problems import did_you_mean
from uasfly.messages import Array
from uasfly.vision.detectors import Image, grey_picture
from uasfly.vision.opencv_detector import dictionary_of
from uasfly.vision.sheets import Sheet, Square

LEAST_CORNERS = 8
_EXPECTED = "expected charuco:COLUMNSxROWS:SQUARE_M:MARKER_M:DICTIONARY[:legacy], as in charuco:7x5:0.04:0.02:4x4_50"
_PATTERN = re.compile(r"charuco:(\d{1,3})x(\d{1,3}):([0-9.]{1,10}):([0-9.]{1,10}):([a-z0-9_]{1,30})(:legacy)?")


@dataclass(frozen=True, slots=True)
class BoardView:
    """The board in one picture.

    Attributes:
        name: for people.
        points: (n, 3) m, the seen corners on the board.
        pixels: (n, 2) px, where they are.
    """

    name: str
    points: Array
    pixels: Array

    def without(self, bad: Array) -> BoardView:
        """The view without the corners where `bad` (n,) is true."""
        return BoardView(self.name, self.points[~bad.astype(bool)], self.pixels[~bad.astype(bool)])


@dataclass(frozen=True)
class CharucoBoard:
    """A chessboard with a marker in each white square.

    Attributes:
        columns, rows: squares across and down.
        square_m, marker_m: sides of a square and of a marker's black square.
        family: dictionary of the markers.
        legacy: whether it was made by OpenCV before 4.6, where boards of an even number of rows begin with white.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    family: Family
    legacy: bool = False
    _made: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def parse(cls, text: str) -> CharucoBoard:
        """The board that a text names.

        Raises:
            UasflyError: the text is none of a board, or there is no such board.
        """
        match = _PATTERN.fullmatch(text.strip().lower())
        if match is None:
            raise UasflyError(f"--board: {_EXPECTED}; found {text!r}")
        columns, rows, name = int(match[1]), int(match[2]), match[5]
        try:
            square, marker = float(match[3]), float(match[4])
        except ValueError:
            raise UasflyError(f"--board: {_EXPECTED}; found {text!r}") from None
        families = get_args(Family)
        family = name if name in families else f"aruco_{name}"
        if family not in families or family.startswith("stag"):
            raise UasflyError(f"--board: no dictionary {name!r}; {did_you_mean(name, families)}")
        if not (3 <= columns <= 60 and 3 <= rows <= 60):
            raise UasflyError(f"--board: expected 3 to 60 squares each way, found {columns}x{rows}")
        if not 0.001 <= marker < square <= 2.0:
            raise UasflyError(f"--board: expected 0.001 <= marker < square <= 2 m, found {marker:g} in {square:g}")
        board = cls(columns, rows, square, marker, family, match[6] is not None)  # type: ignore[arg-type]
        have, need = len(dictionary_of(board.family).bytesList), columns * rows // 2
        if have < need:
            raise UasflyError(
                f"--board: {columns}x{rows} squares need {need} markers; {name} has {have}, take a larger"
            )
        return board

    @property
    def opencv(self) -> Any:
        """OpenCV's board."""
        if "board" not in self._made:
            import cv2

            size, dictionary = (self.columns, self.rows), dictionary_of(self.family)
            board = cv2.aruco.CharucoBoard(size, self.square_m, self.marker_m, dictionary)
            board.setLegacyPattern(self.legacy)
            self._made["board"] = board
        return self._made["board"]

    def find(self, name: str, image: Image) -> BoardView | None:
        """The board in a picture; None where fewer than LEAST_CORNERS corners, or those of one line only, are seen."""
        import cv2

        if "detector" not in self._made:
            self._made["detector"] = cv2.aruco.CharucoDetector(self.opencv)
        corners, numbers, _, _ = self._made["detector"].detectBoard(np.ascontiguousarray(grey_picture(image)))
        if corners is None or numbers is None or len(corners) < LEAST_CORNERS:
            return None
        points = np.asarray(self.opencv.getChessboardCorners(), dtype=float)[np.asarray(numbers).ravel()]
        spans = np.ptp(points[:, :2], axis=0) / self.square_m
        if spans.min() < 0.5 or spans.max() < 1.5:
            return None
        return BoardView(name, points, np.asarray(corners, dtype=float).reshape(-1, 2))

    def black_squares(self) -> Array:
        """(m, 2) column and row, from 0 at the top left, of the squares without a marker."""
        quads = np.array([np.asarray(quad, dtype=float)[:, :2].min(axis=0) for quad in self.opencv.getObjPoints()])
        white = {(int(column), int(row)) for column, row in quads // self.square_m}
        every = [(column, row) for column in range(self.columns) for row in range(self.rows)]
        return np.array([place for place in every if place not in white], dtype=float)

    def sheet(self) -> Sheet:
        """The board for printing, with a white margin of half a square."""
        import cv2

        unit, dictionary = 1000.0 * self.square_m, dictionary_of(self.family)
        cells = dictionary.markerSize + 2
        edge = 1000.0 * self.marker_m / cells
        width, height, margin = self.columns * unit, self.rows * unit, 0.5 * unit
        squares = []
        for marker_id, quad in zip(np.ravel(self.opencv.getIds()), self.opencv.getObjPoints(), strict=True):
            left, top = 1000.0 * np.asarray(quad, dtype=float)[:, :2].min(axis=0)
            bits = cv2.aruco.generateImageMarker(dictionary, int(marker_id), cells)
            for row, column in np.argwhere(bits < 128):
                low = margin + height - (top + (row + 1) * edge)
                squares.append(Square(float(margin + left + column * edge), float(low), edge))
        squares += [
            Square(margin + column * unit, margin + height - (row + 1) * unit, unit)
            for column, row in self.black_squares().tolist()
        ]
        name = self.family.removeprefix("aruco_")
        title = (
            f"ChArUco {self.columns}x{self.rows}, squares {unit:g} mm, markers {1000.0 * self.marker_m:g} mm, {name}"
        )
        return Sheet(title, width + 2 * margin, height + 2 * margin, tuple(squares))
