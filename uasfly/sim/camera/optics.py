"""What lens and sensor do to a picture: blur, vignetting, things in front of the lens, noise, 8 bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uasfly.camera import Camera
from uasfly.sim.camera.settings import CameraSettings, Noise, Occlusion

Picture = NDArray[np.float32]
Image = NDArray[np.uint8]

_NOISE_FRAMES = 3  # of normal numbers are drawn once; each picture begins somewhere else in them


class Lens:
    """Blur and vignetting of one camera, and what is in front of it.

    Args:
        camera: its size.
        settings: blur, vignetting and the schedule of occlusions.
        valid: (height, width), where any light arrives at all.
    """

    def __init__(self, camera: Camera, settings: CameraSettings, valid: NDArray[np.bool_]) -> None:
        height, width = camera.height_px, camera.width_px
        x = (np.arange(width) - 0.5 * (width - 1)) / (0.5 * np.hypot(width, height))
        y = (np.arange(height) - 0.5 * (height - 1)) / (0.5 * np.hypot(width, height))
        shade = 1.0 - settings.vignetting * (x**2 + y[:, None] ** 2)
        self._shade: Picture | None = None
        if settings.vignetting or not valid.all():
            self._shade = np.asarray(np.where(valid, shade, 0.0), dtype=np.float32)
        self._blur_px = settings.lens_blur_px
        self._occlusions = settings.occlusions

    def hidden(self, since_s: float) -> list[Occlusion]:
        """What is in front of the lens at a time on the schedule's clock."""
        return [it for it in self._occlusions if it.start_s <= since_s < it.end_s and it.share > 0.0]

    def apply(self, picture: Picture, since_s: float) -> Picture:
        """The picture (height, width) as it arrives on the sensor."""
        for occlusion in self.hidden(since_s):
            columns, rows = hidden_part(occlusion, picture.shape[1], picture.shape[0])
            picture[rows, columns] = occlusion.level
        if self._blur_px > 0.0:
            import cv2

            side = 2 * max(1, int(np.ceil(3.0 * self._blur_px))) + 1
            blurred = cv2.GaussianBlur(picture, (side, side), self._blur_px, borderType=cv2.BORDER_REPLICATE)
            picture = np.asarray(blurred, dtype=np.float32)
        if self._shade is not None:
            picture *= self._shade
        return picture


class Sensor:
    """Noise and quantisation.

    Args:
        noise: its size.
        shape: (height, width).
        rng: draws it.
    """

    def __init__(self, noise: Noise, shape: tuple[int, int], rng: np.random.Generator) -> None:
        self._noise = noise
        self._rng = rng
        self._shape = shape
        self._quiet = not (noise.read or noise.shot)
        count = 0 if self._quiet else _NOISE_FRAMES * shape[0] * shape[1]
        self._normal = rng.standard_normal(count, dtype=np.float32)

    def read_out(self, picture: Picture) -> Image:
        """The picture (height, width), 0..1, as 8 bits with noise; it is changed on the way."""
        import cv2

        if not self._quiet:
            count = picture.size
            start = int(self._rng.integers(0, len(self._normal) - count))
            sigma = cv2.sqrt(cv2.addWeighted(picture, self._noise.shot**2, picture, 0.0, self._noise.read**2))
            picture += sigma * self._normal[start : start + count].reshape(self._shape)
        return np.asarray(cv2.convertScaleAbs(np.maximum(picture, np.float32(0.0)), alpha=255.0), dtype=np.uint8)


def hidden_part(occlusion: Occlusion, width: int, height: int) -> tuple[slice, slice]:
    """Columns and rows that an occlusion hides."""
    wide, high = round(occlusion.share * width), round(occlusion.share * height)
    match occlusion.side:
        case "left":
            return slice(0, wide), slice(0, height)
        case "right":
            return slice(width - wide, width), slice(0, height)
        case "top":
            return slice(0, width), slice(0, high)
        case "bottom":
            return slice(0, width), slice(height - high, height)
