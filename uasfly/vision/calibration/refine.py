"""Exact corners of a board once its lens is roughly known: lines fitted to the edges of its black squares.

OpenCV looks at a few pixels around each corner, because markers are near. The squares' edges are long: lines along
them, straight once the lens is taken out, meet several times nearer to the true corner. Each corner belongs to two
squares.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.calibration.board import LEAST_CORNERS, BoardView, CharucoBoard
from uasfly.vision.calibration.lens import Lens, LensFit, LensModel, calibrate_lens
from uasfly.vision.detectors import Image, grey_picture
from uasfly.vision.edges import fit_edges

_PROFILE_SHARE = 0.8  # of the white between a square's edge and the next marker
_WIDEST = 0.15  # of a square's side, where there is more white
_EDGE_PX = 4.0  # squares nearer to the picture's edge are left
_LEAST_SIDE_PX = 12.0
_AGREE_PX = 0.5  # two squares that tell a corner further apart are not believed


def calibrate_exactly(
    board: CharucoBoard,
    views: list[BoardView],
    images: Mapping[str, Image],
    size: tuple[int, int],
    model: LensModel = "5",
) -> LensFit:
    """Lens from OpenCV's corners, then from exact ones, where those fit better.

    Args:
        board: that is seen.
        views: of it.
        images: the pictures by their views' names.
        size: of the pictures [px].
        model: of the lens.

    Raises:
        UasflyError: as `calibrate_lens`.
    """
    fit = calibrate_lens(views, size, model)
    camera = camera_of(fit.lens, size)
    exact = []
    for view, pose in zip(fit.views, fit.poses, strict=True):
        image = images.get(view.name)
        found = None if image is None else exact_view(board, view.name, image, fit.lens, pose, camera)
        if found is None:
            return fit
        exact.append(found)
    better = calibrate_lens(exact, size, model)
    better.rejected[:0] = fit.rejected
    return better if better.rms_px < fit.rms_px else fit


def exact_view(
    board: CharucoBoard, name: str, image: Image, lens: Lens, pose: tuple[Array, Array], camera: Camera
) -> BoardView | None:
    """The board's corners from its squares' edges; None where there are too few.

    Args:
        board: that is seen.
        name: of the view.
        image: the picture.
        lens: roughly right, as is `pose` (rotation vector, position).
        pose: of the board in camera axes.
        camera: the same lens.
    """
    squares = board.black_squares()
    corners = np.array(((0, 0), (1, 0), (1, 1), (0, 1)))
    places = squares[:, None] + corners  # (m, 4, 2) in squares
    points = np.concatenate((board.square_m * places, np.zeros((*places.shape[:2], 1))), axis=2)
    quads = lens.project(points.reshape(-1, 3), *pose)[0].reshape(-1, 4, 2)
    low, high = quads.min(axis=(1, 2)), (quads - (camera.width_px, camera.height_px)).max(axis=(1, 2))
    side = np.linalg.norm(np.roll(quads, -1, axis=1) - quads, axis=2).min(axis=1)
    inside = (low > _EDGE_PX) & (high < -_EDGE_PX) & (side > _LEAST_SIDE_PX)
    white = 0.5 * (board.square_m - board.marker_m) / board.square_m
    fit = fit_edges(grey_picture(image), quads[inside], min(_PROFILE_SHARE * white, _WIDEST), camera)
    told: dict[tuple[int, int], list[Array]] = {}
    for place, found, good in zip(places[inside], fit.corners, fit.fitted, strict=True):
        for (column, row), pixel in zip(place, found, strict=True):
            if good and 0 < column < board.columns and 0 < row < board.rows:
                told.setdefault((int(column), int(row)), []).append(pixel)
    agreed = {at: np.mean(pixels, axis=0) for at, pixels in told.items() if np.ptp(pixels, axis=0).max() < _AGREE_PX}
    if len(agreed) < LEAST_CORNERS:
        return None
    flat = board.square_m * np.array([(*at, 0.0) for at in agreed])
    return BoardView(name, flat, np.array(list(agreed.values())))


def camera_of(lens: Lens, size: tuple[int, int]) -> Camera:
    """The lens as a camera without a mounting."""
    kind = "fisheye" if lens.model == "fisheye" else "pinhole"
    fields = {
        "name": "lens", "model": kind, "width_px": size[0], "height_px": size[1], "fx": float(lens.matrix[0, 0]),
        "fy": float(lens.matrix[1, 1]), "cx": float(lens.matrix[0, 2]), "cy": float(lens.matrix[1, 2]),
        "distortion": lens.coefficients.tolist(), "transform_camera_to_body": {},
    }  # fmt: skip
    return Camera.model_validate(fields)
