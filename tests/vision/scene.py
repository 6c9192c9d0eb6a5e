"""Pictures of printed boards as a camera sees them: each pixel averages rays, then blur and noise.

Independent of the code under test but for the camera's rays: the board is a plane, its texture drawn cell by cell.
"""

from __future__ import annotations

import cv2
import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.messages import Array
from uasfly.vision.opencv_detector import dictionary_of

DARK, BRIGHT, AROUND = 35.0, 215.0, 110.0


def board_texture(bundle: Bundle, pixels_per_m: float) -> tuple[np.ndarray, Array]:
    """Texture of a flat bundle of unturned OpenCV markers and the bundle coordinates (2,) of its left top edge."""
    dictionary = dictionary_of(bundle.family)
    cells = dictionary.markerSize + 2
    quads = np.array([bundle.corners(marker.id)[:, :2] for marker in bundle.markers])
    margin = 1.5 * max(marker.size_m for marker in bundle.markers) / cells
    left, top = quads[..., 0].min() - margin, quads[..., 1].max() + margin
    right, bottom = quads[..., 0].max() + margin, quads[..., 1].min() - margin
    shape = (round((top - bottom) * pixels_per_m), round((right - left) * pixels_per_m))
    texture = np.full(shape, BRIGHT, dtype=np.float32)
    for marker in bundle.markers:
        bits = cv2.aruco.generateImageMarker(dictionary, marker.id, cells)
        x, y = marker.position_m[0] - 0.5 * marker.size_m, marker.position_m[1] + 0.5 * marker.size_m
        for row in range(cells):
            for column in range(cells):
                if bits[row, column] < 128:
                    edges = [
                        round((x + column * marker.size_m / cells - left) * pixels_per_m),
                        round((x + (column + 1) * marker.size_m / cells - left) * pixels_per_m),
                        round((top - y + row * marker.size_m / cells) * pixels_per_m),
                        round((top - y + (row + 1) * marker.size_m / cells) * pixels_per_m),
                    ]
                    texture[edges[2] : edges[3], edges[0] : edges[1]] = DARK
    return texture, np.array((left, top))


def render(
    bundle: Bundle,
    camera: Camera,
    rotation: Array,
    position: Array,
    rng: np.random.Generator,
    *,
    blur_px: float = 0.9,
    noise: float = 4.0,
    supersampling: int = 3,
    pixels_per_m: float = 2000.0,
) -> np.ndarray:
    """Picture (h, w) uint8 of the bundle at rotation (3, 3), position (3,) [m] in camera axes."""
    texture, left_top = board_texture(bundle, pixels_per_m)
    return render_plane(texture, left_top, camera, rotation, position, rng, blur_px, noise, supersampling, pixels_per_m)


def render_plane(
    texture: np.ndarray,
    left_top: Array,
    camera: Camera,
    rotation: Array,
    position: Array,
    rng: np.random.Generator,
    blur_px: float,
    noise: float,
    supersampling: int,
    pixels_per_m: float,
) -> np.ndarray:
    """Picture (h, w) uint8 of a texture in the plane z = 0 (y up) whose left top edge is at `left_top` (2,) [m]."""
    left, top = left_top
    height, width = texture.shape
    board = np.array(((0, 0), (width, 0), (width, height), (0, height))) / pixels_per_m
    outline = np.column_stack((left + board[:, 0], top - board[:, 1], np.zeros(4)))
    seen = camera.project(outline @ rotation.T + position)
    low = np.clip(np.floor(seen.min(axis=0)) - 8, 0, (camera.width_px - 1, camera.height_px - 1)).astype(int)
    high = np.clip(np.ceil(seen.max(axis=0)) + 9, 1, (camera.width_px, camera.height_px)).astype(int)
    u, v = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    plane: Array = camera.normalise(np.column_stack((u.ravel(), v.ravel()))).reshape(*u.shape, 2)
    down, across = np.gradient(plane, axis=(0, 1))  # within a pixel the lens is straight
    texture = cv2.copyMakeBorder(texture, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=AROUND)
    normal, total = rotation[:, 2], np.zeros(u.shape)
    fine = (np.arange(supersampling) + 0.5) / supersampling - 0.5
    for dx in fine:
        for dy in fine:
            x, y = np.moveaxis(plane + dx * across + dy * down, -1, 0)
            depth = (normal @ position) / (normal[0] * x + normal[1] * y + normal[2])
            ray = np.stack((x * depth, y * depth, depth), axis=-1) - position
            right, up = ray @ rotation[:, 0], ray @ rotation[:, 1]
            total += _interpolated(texture, (right - left) * pixels_per_m + 1.5, (top - up) * pixels_per_m + 1.5)
    picture: np.ndarray = np.full((camera.height_px, camera.width_px), AROUND, dtype=np.float32)
    picture[low[1] : high[1], low[0] : high[0]] = total / supersampling**2
    if blur_px > 0.0:
        picture = cv2.GaussianBlur(picture, (0, 0), blur_px)
    picture = picture + rng.normal(0.0, noise, picture.shape).astype(np.float32)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def _interpolated(texture: np.ndarray, x: Array, y: Array) -> Array:
    """Bilinear, by hand: cv2.remap gives NaN here and there in OpenCV 5.0."""
    height, width = texture.shape
    x, y = np.clip(x, 0.0, width - 1.001), np.clip(y, 0.0, height - 1.001)
    column, row = x.astype(int), y.astype(int)
    x, y = x - column, y - row
    above = texture[row, column] * (1 - x) + texture[row, column + 1] * x
    below = texture[row + 1, column] * (1 - x) + texture[row + 1, column + 1] * x
    return np.asarray(above * (1 - y) + below * y)


def facing_rotation(rng: np.random.Generator, tilt_deg: float) -> Array:
    """Rotation (3, 3) bundle to camera of a board that faces the camera upright, tilted by up to `tilt_deg`."""
    facing = np.diag((1.0, -1.0, -1.0))
    axis = rng.normal(size=3) * (1.0, 1.0, 0.6)
    axis /= np.linalg.norm(axis)
    tilt, _ = cv2.Rodrigues(axis * np.radians(rng.uniform(0.0, tilt_deg)))
    return np.asarray(tilt @ facing, dtype=float)
