"""What every marker detector gives.

Corners are in OpenCV's convention whatever library found them: the centre of the top-left pixel is (0, 0); the order is
top-left, top-right, bottom-right, bottom-left of the upright marker seen from the front.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uasfly.errors import UasflyError
from uasfly.messages import Array

Image = NDArray[np.uint8]

# Cells along the side of a marker, its black border included.
_CELLS = {
    "36h11": 8, "36h10": 8, "25h9": 7, "16h5": 6, "aruco_4x4": 6, "aruco_5x5": 7, "aruco_6x6": 8, "aruco_7x7": 9,
    "aruco_original": 7, "aruco_mip_36h12": 8, "stag": 10,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Detection:
    """One marker in one picture.

    Attributes:
        marker_id: as decoded.
        corners: (4, 2) px.
        sigma_px: standard deviation of a corner, an axis.
        fitted: the corners are those of lines fitted to the edges; False where the detector's own had to do.
        straightness_px: how far points of the edges lie off their lines, RMS; NaN where not fitted.
    """

    marker_id: int
    corners: Array
    sigma_px: float
    fitted: bool = False
    straightness_px: float = float("nan")


@dataclass(frozen=True, slots=True)
class Region:
    """A part of a picture: left and top edge, width and height [px]."""

    x: int
    y: int
    width: int
    height: int

    def crop(self, image: Image) -> Image:
        """That part of the picture (a view)."""
        return image[self.y : self.y + self.height, self.x : self.x + self.width]


class Detector(Protocol):
    """Finds the markers of one family in a grey picture; the corners are rough, `edges` makes them exact."""

    @property
    def border(self) -> float:
        """Width of the black border as a fraction of the marker's side."""
        ...

    def find(self, grey: Image) -> list[tuple[int, Array]]:
        """Ids and corners (4, 2) [px] in the conventions of this module."""
        ...


def border_of(family: str) -> float:
    """Width of the narrowest part of the black border as a fraction of the marker's side."""
    return next(1.0 / cells for name, cells in _CELLS.items() if family.startswith(name))


def grey_picture(image: Image) -> Image:
    """The picture in grey: (h, w) as it is, (h, w, 3) blue-green-red and (h, w, 4) converted.

    Raises:
        UasflyError: it is no picture of 8-bit values.
    """
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
        raise UasflyError(f"expected a picture (h, w) or (h, w, 3) of uint8, found {image.shape} of {image.dtype}")
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[:, :, 0]
    import cv2

    code = cv2.COLOR_BGR2GRAY if image.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
    return np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)
