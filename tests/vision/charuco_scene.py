"""Views of a ChArUco board through a lens with distortion, rendered from its printed squares."""

from __future__ import annotations

from functools import cache

import numpy as np

from tests.vision.scene import BRIGHT, DARK, facing_rotation, render_plane
from tests.vision.test_camera import camera
from uasfly.camera import Camera
from uasfly.vision.calibration.board import CharucoBoard
from uasfly.vision.detectors import Image
from uasfly.vision.sheets import Sheet

BOARD = CharucoBoard.parse("charuco:9x6:0.04:0.03:4x4_50")
PIXELS_PER_M = 2500.0
TRUE = camera(
    [-0.21, 0.07, 0.0008, -0.0006, -0.01], width_px=640, height_px=480, fx=521.0, fy=523.5, cx=326.0, cy=233.0
)


def texture_of(sheet: Sheet, pixels_per_m: float) -> np.ndarray:
    """The sheet in grey values, its margin included."""
    scale = pixels_per_m / 1000.0
    texture = np.full((round(sheet.height_mm * scale), round(sheet.width_mm * scale)), BRIGHT, dtype=np.float32)
    for square in sheet.squares:
        left, right = round(square.x * scale), round((square.x + square.side) * scale)
        top = round((sheet.height_mm - square.y - square.side) * scale)
        bottom = round((sheet.height_mm - square.y) * scale)
        texture[top:bottom, left:right] = DARK
    return texture


def charuco_view(lens: Camera, rng: np.random.Generator, at: tuple[float, float], depth: float) -> Image:
    """The board with its middle at a place of the picture (share of width and height) and a depth [m], tilted."""
    sheet = BOARD.sheet()
    texture = texture_of(sheet, PIXELS_PER_M)
    left_top = np.array((-0.5 * sheet.width_mm, 0.5 * sheet.height_mm)) / 1000.0
    (ray,) = lens.unproject(np.array([(at[0] * lens.width_px, at[1] * lens.height_px)]))
    return render_plane(
        texture, left_top, lens, facing_rotation(rng, 42.0), ray * depth / ray[2], rng, 0.7, 3.0, 2, PIXELS_PER_M
    )


@cache
def charuco_views(count: int = 18) -> tuple[Image, ...]:
    """Views all over the picture."""
    rng, views = np.random.default_rng(11), []
    for index in range(count):
        at = (0.18 + 0.64 * ((index * 5) % count) / (count - 1), 0.2 + 0.6 * (index % 3) / 2.0)
        views.append(charuco_view(TRUE, rng, at, float(rng.uniform(0.33, 0.6))))
    return tuple(views)
