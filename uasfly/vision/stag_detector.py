"""STag (extra `stag`): the markers that Kalaitzakis & Vitzilaios flew; steady, and slower than OpenCV's."""

from __future__ import annotations

from typing import Any

import numpy as np

from uasfly.bundle import Family
from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.detectors import Image, border_of


class StagDetector:
    """Finds the markers of one library (HD11 to HD23).

    Its pixels are counted as OpenCV's; its corners lie half a pixel inside the marker, which the line fit mends.

    Args:
        family: stag_hd11 .. stag_hd23.

    Raises:
        UasflyError: the library is not installed.
    """

    def __init__(self, family: Family) -> None:
        try:
            import stag
        except ImportError:
            problem = f"markers {family} need the STag library; install it (pip install 'uasfly[stag]')"
            raise UasflyError(problem) from None
        self._border = border_of(family)
        self._library = int(family.removeprefix("stag_hd"))
        self._stag: Any = stag

    @property
    def border(self) -> float:
        """Width of the narrowest part of the black border as a fraction of the marker's side."""
        return self._border

    def find(self, grey: Image) -> list[tuple[int, Array]]:
        """Ids and corners (4, 2) [px], as `Detector` says."""
        corners, ids, _ = self._stag.detectMarkers(np.ascontiguousarray(grey), self._library)
        numbers = np.asarray(ids).ravel()
        return [
            (int(number), np.asarray(quad, dtype=float).reshape(4, 2))
            for number, quad in zip(numbers, corners, strict=True)
        ]
