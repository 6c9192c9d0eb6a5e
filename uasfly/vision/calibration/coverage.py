"""What views of a board have in common and what is still missing: regions of the picture, tilts, distances.

Poses are rough here: the focal length is not known yet, one of 0.9 picture widths is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.vision.calibration.board import BoardView

COLUMNS, ROWS = 6, 4
ENOUGH_VIEWS = 15
_REGION_CORNERS = 3  # in a region, over all views, for it to count as covered
_ENOUGH_REGIONS = 0.85
_TILT = math.sin(math.radians(18.0))
_SIZES = 1.5  # largest to smallest apparent size
_GUESSED_FOCAL = 0.9
_SAME = 0.12  # views whose places differ by less say the same
_HORIZONTAL, _VERTICAL = ("left", "centre", "right"), ("upper", "middle", "lower")


@dataclass(frozen=True, slots=True)
class Coverage:
    """How well views cover what a lens's calibration needs.

    Attributes:
        views: how many.
        regions: (ROWS, COLUMNS) corners in each region of the picture.
        covered: share of the regions with corners enough.
        tilts_deg: how far the board was turned away, at most: left, right, up, down edge away.
        sizes: largest to smallest apparent size of the board's squares.
        hints: what to do next, the most important first; empty where it is enough.
    """

    views: int
    regions: Array
    covered: float
    tilts_deg: tuple[float, float, float, float]
    sizes: float
    hints: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Whether nothing is missing."""
        return not self.hints


def place_of(view: BoardView, width: int, height: int) -> Array:
    """(5,) where a view is among possible ones: centre in picture sizes, log of the size, normal's x and y.

    Args:
        view: of the board.
        width: of the picture [px].
        height: the same.
    """
    import cv2

    focal = _GUESSED_FOCAL * max(width, height)
    matrix = np.array(((focal, 0.0, 0.5 * width), (0.0, focal, 0.5 * height), (0.0, 0.0, 1.0)))
    there, turned, at = cv2.solvePnP(view.points, view.pixels, matrix, None, flags=cv2.SOLVEPNP_IPPE)
    if not there:
        return np.array((0.5, 0.5, 0.0, 0.0, 0.0))
    rotation, _ = cv2.Rodrigues(turned)
    middle = rotation @ view.points.mean(axis=0) + at.ravel()
    centre = view.pixels.mean(axis=0) / (width, height)
    across = float(rotation[:, 2] @ middle) / float(np.linalg.norm(middle))
    normal = rotation[:, 2] * (1.0 if across > 0.0 else -1.0)  # away from the camera
    return np.array((*centre, -math.log(max(float(middle[2]), 1e-3)), normal[0], normal[1]))


def coverage(views: list[BoardView], places: list[Array], width: int, height: int) -> Coverage:
    """What these views cover.

    Args:
        views: of the board.
        places: of each, as `place_of` gives them.
        width: of the picture [px].
        height: the same.
    """
    regions = np.zeros((ROWS, COLUMNS))
    for view in views:
        column = np.clip(view.pixels[:, 0] * COLUMNS / width, 0, COLUMNS - 1).astype(int)
        row = np.clip(view.pixels[:, 1] * ROWS / height, 0, ROWS - 1).astype(int)
        np.add.at(regions, (row, column), 1.0)
    covered = float((regions >= _REGION_CORNERS).mean())
    at = np.array(places).reshape(-1, 5)
    x, y = at[:, 3], at[:, 4]
    tilts = (max(-x.min(initial=0.0), 0.0), x.max(initial=0.0), max(-y.min(initial=0.0), 0.0), y.max(initial=0.0))
    sizes = float(np.exp(np.ptp(at[:, 2]))) if len(at) else 1.0
    degrees = tuple(math.degrees(math.asin(min(float(tilt), 1.0))) for tilt in tilts)
    hints = _hints(len(views), regions, covered, tilts, sizes, at)
    return Coverage(len(views), regions, covered, degrees, sizes, hints)  # type: ignore[arg-type]


def _hints(
    count: int, regions: Array, covered: float, tilts: tuple[float, ...], sizes: float, places: Array
) -> tuple[str, ...]:
    if not count:
        return ("show the board to the camera, whole, so that it fills a third of the picture",)
    hints = []
    if covered < _ENOUGH_REGIONS:
        hints.append(f"move the board to the {_emptiest(regions)} of the picture")
    for axis, edges in enumerate(("left or right", "upper or lower")):
        low, high = tilts[2 * axis], tilts[2 * axis + 1]
        if max(low, high) < _TILT or low + high < 1.5 * _TILT:
            hints.append(f"tilt it more: turn its {edges} edge away from the camera, by 20 to 40 degrees")
    if sizes < _SIZES:
        near = "nearer, until it fills most of the picture" if places[:, 2].max() < 0.5 else "farther away"
        hints.append(f"hold it at other distances too: come {near}")
    if not hints and count < ENOUGH_VIEWS:
        hints.append(f"go on with other places and tilts: {ENOUGH_VIEWS - count} more views")
    return tuple(hints)


def _emptiest(regions: Array) -> str:
    """Name of the part of the picture with the fewest corners, corners of the picture first."""
    from_middle = np.hypot(*np.meshgrid(np.linspace(-1.0, 1.0, COLUMNS), np.linspace(-1.0, 1.0, ROWS)))
    row, column = np.unravel_index(int(np.argmin(regions - 1e-3 * from_middle)), regions.shape)
    vertical = _VERTICAL[int(row) * 3 // ROWS if row < ROWS - 1 else 2]
    horizontal = _HORIZONTAL[int(column) * 3 // COLUMNS]
    if (vertical, horizontal) == ("middle", "centre"):
        return "centre"
    return f"{vertical} {horizontal}"


def is_new(place: Array, places: list[Array]) -> bool:
    """Whether a view differs enough from those that are there."""
    return not places or float(np.linalg.norm(np.array(places) - place, axis=1).min()) > _SAME


def spread(places: list[Array], most: int) -> list[int]:
    """Indices of up to `most` views, each next one the farthest from those that are chosen (Gonzalez 1985)."""
    if not places:
        return []
    at = np.array(places)
    chosen = [int(np.argmin(np.linalg.norm(at - np.median(at, axis=0), axis=1)))]
    nearest = np.linalg.norm(at - at[chosen[0]], axis=1)
    while len(chosen) < min(most, len(at)) and nearest.max() > 0.25 * _SAME:
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(at - at[chosen[-1]], axis=1))
    return sorted(chosen)
