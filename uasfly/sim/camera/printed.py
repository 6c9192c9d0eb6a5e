"""Printed markers: the pattern of each as a table of sums, from which any rectangle's brightness is exact.

A printed marker is a grid of cells of one brightness each. The integral of the brightness over the rectangle from the
grid's corner to (u, v) is bilinear within a cell, so linear interpolation in the table of sums (Crow 1984) gives the
mean over any rectangle without error, at any distance and without any resolution of a texture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uasfly.bundle import Bundle, BundleMarker
from uasfly.errors import UasflyError
from uasfly.messages import Array

QUIET_CELLS = 1  # white around a marker, where its neighbours leave room for it


@dataclass(frozen=True, slots=True)
class PrintedMarker:
    """One marker as it is printed.

    Attributes:
        marker_id: its id.
        sums: (n + 1, n + 1) float32, table of sums of the cells' brightness minus `level`.
        level: mean of ink and paper, 0..1.
        first, last: range of u and v that is printed [cells]; outside is the background.
        cells_to_bundle: (3, 3), takes (u, v, 1) [cells, u right, v down] to a point in the bundle's frame [m].
        corners_in_bundle: (4, 3) m, of the printed range, with the white around.
        black_corners_in_bundle: (4, 3) m, of the black square, in OpenCV's order.
        size_m: side of the black square.
    """

    marker_id: int
    sums: NDArray[np.float32]
    level: float
    first: float
    last: float
    cells_to_bundle: Array
    corners_in_bundle: Array
    black_corners_in_bundle: Array
    size_m: float


def print_markers(bundle: Bundle, ink: float, paper: float) -> list[PrintedMarker]:
    """The markers of a bundle, large ones first, so that a small one within a large one stays visible.

    Args:
        bundle: what is printed.
        ink: brightness of black, 0..1.
        paper: brightness of white, 0..1.

    Raises:
        UasflyError: the family cannot be printed, or has no marker of such an id.
    """
    ordered = sorted(bundle.markers, key=lambda marker: (-marker.size_m, marker.id))
    return [_printed(marker, bundle, ink, paper) for marker in ordered]


def marker_cells(family: str, marker_id: int) -> NDArray[np.uint8]:
    """Cells (n, n) of a marker with its black border: 1 white, 0 black.

    Raises:
        UasflyError: the family cannot be printed, or has no marker of such an id.
    """
    import cv2

    plain = family.removeprefix("aruco_")
    wanted = [f"dict_apriltag_{family}", f"dict_{plain}", f"dict_{family}"]  # their case differs between versions
    numbers = {name.lower(): number for name, number in vars(cv2.aruco).items() if name.startswith("DICT_")}
    number = next((numbers[name] for name in wanted if name in numbers), None)
    if number is None:
        raise UasflyError(
            f"the simulated camera cannot print markers of the family {family}; expected an AprilTag or ArUco family"
        )
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    count = len(dictionary.bytesList)
    if marker_id >= count:
        raise UasflyError(f"the family {family} has the ids 0 to {count - 1}; found id {marker_id}")
    side = dictionary.markerSize + 2
    picture = cv2.aruco.generateImageMarker(dictionary, marker_id, side)
    return np.asarray(picture > 127, dtype=np.uint8)


def _printed(marker: BundleMarker, bundle: Bundle, ink: float, paper: float) -> PrintedMarker:
    black = marker_cells(bundle.family, marker.id)
    side = len(black)
    cell_m = marker.size_m / side
    quiet = min(float(QUIET_CELLS), max(0.0, 0.5 * _gap(marker, bundle) / cell_m))
    cells = np.ones((side + 2 * QUIET_CELLS,) * 2)
    cells[QUIET_CELLS:-QUIET_CELLS, QUIET_CELLS:-QUIET_CELLS] = black
    level = 0.5 * (ink + paper)
    sums = np.zeros((len(cells) + 1,) * 2)
    sums[1:, 1:] = (ink + (paper - ink) * cells - level).cumsum(axis=0).cumsum(axis=1)
    middle = 0.5 * len(cells)
    right, up = marker.rotation[:, 0] * cell_m, marker.rotation[:, 1] * cell_m
    cells_to_bundle = np.column_stack((right, -up, marker.position - middle * (right - up)))
    first, last = QUIET_CELLS - quiet, len(cells) - QUIET_CELLS + quiet
    outline = np.array(((first, first, 1.0), (last, first, 1.0), (last, last, 1.0), (first, last, 1.0)))
    return PrintedMarker(
        marker.id,
        sums.astype(np.float32),
        level,
        first,
        last,
        cells_to_bundle,
        outline @ cells_to_bundle.T,
        marker.corners,
        marker.size_m,
    )


def _gap(marker: BundleMarker, bundle: Bundle) -> float:
    """Distance [m] to the nearest other black square that is not within this one or around it; infinite without."""
    gaps = [np.inf]
    half = 0.5 * marker.size_m
    for other in bundle.markers:
        if other.id == marker.id:
            continue
        corners = (other.corners - marker.position) @ marker.rotation
        low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
        apart = np.maximum(np.maximum(low - half, -half - high), 0.0)
        if apart.any():
            gaps.append(float(np.hypot(*apart)) if apart.all() else float(apart.max()))
    return min(gaps)
