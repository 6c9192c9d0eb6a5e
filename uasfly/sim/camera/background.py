"""What is behind the markers: a picture that repeats over the plane of the page."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array
from uasfly.sim.camera.settings import Background

TILE_M = 8.0
TILE_PX = 512
LEVELS = 7
_ROUGHNESS = 1.3  # exponent of the amplitude spectrum of concrete
_SQUARES = 60


class BackgroundTexture:
    """A tile of TILE_M by TILE_M metres, at several sharpnesses.

    Args:
        settings: what it looks like.
        rng: draws its grain.

    Attributes:
        levels: (n, n) float32 each, 0..1, two tiles by two, n halved from one to the next.
        plain: its one brightness, where it has only one. level: its mean brightness.
    """

    def __init__(self, settings: Background, rng: np.random.Generator) -> None:
        self.plain: float | None = settings.level if settings.kind == "plain" or not settings.contrast else None
        self.level = settings.level
        self.levels: list[NDArray[np.float32]] = []
        if self.plain is not None:
            return
        tile = _relief(settings, rng)
        for _ in range(LEVELS):
            self.levels.append(np.tile(np.clip(tile, 0.0, 1.0), (2, 2)).astype(np.float32))
            tile = 0.25 * (tile[::2, ::2] + tile[1::2, ::2] + tile[::2, 1::2] + tile[1::2, 1::2])

    def look_up(self, points: Array, footprint_m: float) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
        """A texture, where points are in it, and OpenCV's name of what is beyond its edge.

        Args:
            points: (..., 2) m, on the page's plane.
            footprint_m: the texture's pixels are about as large as this.

        Returns:
            (n, n), (..., 2) [px of it].
        """
        import cv2

        ideal = np.log2(max(footprint_m * TILE_PX / TILE_M, 1.0))
        texture = self.levels[min(len(self.levels) - 1, int(np.ceil(ideal)))]
        scale = 0.5 * len(texture) / TILE_M  # two tiles in each direction
        low = np.floor(points.reshape(-1, 2).min(axis=0) / TILE_M) * TILE_M
        within = bool((points.reshape(-1, 2).max(axis=0) - low).max() < 1.99 * TILE_M)
        # wrapping is slow, and needed only where more than two tiles are seen
        return texture, ((points - low) * scale).astype(np.float32), cv2.BORDER_REPLICATE if within else cv2.BORDER_WRAP


def _relief(settings: Background, rng: np.random.Generator) -> Array:
    if settings.kind == "gradient":
        ramp = 0.5 * np.cos(np.arange(TILE_PX) * (2.0 * np.pi / TILE_PX))
        return np.asarray(settings.level + settings.contrast * (ramp[:, None] + 0.3 * ramp), dtype=float)
    tile = settings.level + 0.5 * settings.contrast * _grain(rng)
    if settings.kind == "clutter":
        _draw_squares(tile, settings, rng)
    return tile


def _grain(rng: np.random.Generator) -> Array:
    """Noise (n, n) of unit deviation that repeats, coarse and fine alike."""
    frequency = np.fft.fftfreq(TILE_PX) * TILE_PX
    radius = np.hypot(frequency[:, None], frequency[: TILE_PX // 2 + 1])
    radius[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal((TILE_PX, TILE_PX))) * radius**-_ROUGHNESS
    grain = np.fft.irfft2(spectrum, s=(TILE_PX, TILE_PX))
    return np.asarray(grain / grain.std(), dtype=float)


def _draw_squares(tile: Array, settings: Background, rng: np.random.Generator) -> None:
    """Dark squares with a light edge and a few light cells within, as window panes, signs and form ties are."""
    for _ in range(_SQUARES):
        side = int(rng.integers(10, 36))
        x, y = (int(value) for value in rng.integers(0, TILE_PX - side, 2))
        edge = max(2, side // 8)
        tile[y : y + side, x : x + side] = settings.level + 1.2 * settings.contrast
        tile[y + edge : y + side - edge, x + edge : x + side - edge] = settings.level - 1.2 * settings.contrast
        for _ in range(int(rng.integers(0, 4))):
            u, v = (int(value) for value in rng.integers(2 * edge, max(2 * edge + 1, side - 3 * edge), 2))
            tile[y + v : y + v + edge, x + u : x + u + edge] = settings.level + settings.contrast
