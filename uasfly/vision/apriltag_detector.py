"""The AprilTag library (extra `apriltag`): sees small and slanted tags further than OpenCV, at twice the time."""

from __future__ import annotations

from typing import Any

import numpy as np

from uasfly.bundle import Family
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.detectors import Image, border_of

# Its corners are left-bottom, right-bottom, right-top, left-top of a tag that is upside down in OpenCV's dictionaries.
_ORDER = [1, 0, 3, 2]
_HALF_PIXEL = 0.5  # its pixels have their corner, not their centre, at whole numbers
_FAMILIES = ("36h11", "25h9", "16h5")
_LEAST_MARGIN = 20.0  # difference between black and white cells and the threshold: less is noise that looks like a tag


class AprilTagDetector:
    """Finds the tags of one family.

    Args:
        family: 36h11, 25h9 or 16h5.
        decimate: quads are looked for in a picture this much smaller.

    Raises:
        UasflyError: the library is not installed or does not know the family.
    """

    def __init__(self, family: Family, decimate: float = 2.0) -> None:
        if family not in _FAMILIES:
            raise UasflyError(f"markers {family}: the AprilTag library knows {', '.join(_FAMILIES)}; use opencv")
        try:
            import apriltag
        except ImportError:
            problem = "the AprilTag library is not installed; install it (pip install 'uasfly[apriltag]') or use opencv"
            raise UasflyError(problem) from None
        self._border = border_of(family)
        self._detector: Any = apriltag.apriltag(f"tag{family}", threads=1, maxhamming=1, decimate=decimate)

    @property
    def border(self) -> float:
        """Width of the black border as a fraction of the marker's side."""
        return self._border

    def find(self, grey: Image) -> list[tuple[int, Array]]:
        """Ids and corners (4, 2) [px], as `Detector` says."""
        return [
            (int(found["id"]), np.asarray(found["lb-rb-rt-lt"], dtype=float)[_ORDER] - _HALF_PIXEL)
            for found in self._detector.detect(np.ascontiguousarray(grey))
            if found["margin"] >= _LEAST_MARGIN
        ]
