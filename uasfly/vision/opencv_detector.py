"""OpenCV's ArUco detector: the ArUco and AprilTag dictionaries, or one from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from uasfly.bundle import Family
from uasfly.errors import FileError
from uasfly.messages import Array
from uasfly.vision.detectors import Image, border_of

LEAST_CELL_PX = 1.0  # smaller ones cannot be read; the outline of a turned marker has up to a third fewer pixels


class OpenCvDetector:
    """Finds the markers of one dictionary.

    The corners are the contour's, without OpenCV's own refinement: on small markers its sub-pixel search walks off to
    the corners of neighbouring cells, and the line fit of `edges` needs no better start.

    Args:
        dictionary: OpenCV's.
        border: width of the black border as a fraction of the marker's side.
    """

    def __init__(self, dictionary: Any, border: float) -> None:
        import cv2

        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self.dictionary = dictionary
        self._border = border
        self._least_px = 4.0 * LEAST_CELL_PX * (dictionary.markerSize + 2)
        self._parameters = parameters
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)

    @classmethod
    def of_family(cls, family: Family) -> OpenCvDetector:
        """Detector of one of OpenCV's dictionaries."""
        return cls(dictionary_of(family), border_of(family))

    @classmethod
    def from_file(cls, path: Path) -> OpenCvDetector:
        """Detector of a dictionary that was written by OpenCV (nmarkers, markersize, marker_0 ...).

        Raises:
            FileError: it cannot be read, or holds no dictionary.
        """
        import cv2

        try:
            storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
            dictionary = cv2.aruco.Dictionary()
            read = storage.isOpened() and dictionary.readDictionary(storage.root())
            storage.release()
        except cv2.error:
            read = False
        if not read:
            expected = "expected a dictionary as OpenCV writes it (nmarkers, markersize, marker_0 ...)"
            raise FileError(str(path), [f"{expected}; found none"])
        return cls(dictionary, 1.0 / (dictionary.markerSize + 2))

    @property
    def border(self) -> float:
        """Width of the black border as a fraction of the marker's side."""
        return self._border

    def find(self, grey: Image) -> list[tuple[int, Array]]:
        """Ids and corners (4, 2) [px], as `Detector` says."""
        # OpenCV counts in shares of the picture: in a small part of it every speck would be looked at
        self._parameters.minMarkerPerimeterRate = self._least_px / max(grey.shape)
        self._detector.setDetectorParameters(self._parameters)
        corners, ids, _ = self._detector.detectMarkers(grey)
        if ids is None:
            return []
        numbers = np.asarray(ids).ravel()  # (n,) in OpenCV 5, (n, 1) before
        return [
            (int(number), np.asarray(quad, dtype=float).reshape(4, 2))
            for number, quad in zip(numbers, corners, strict=True)
        ]


def dictionary_of(family: Family) -> Any:
    """OpenCV's dictionary of a family."""
    import cv2

    name = family.removeprefix("aruco_").upper() if family.startswith("aruco_") else f"APRILTAG_{family.upper()}"
    if family == "aruco_original":
        name = "ARUCO_ORIGINAL"
    if family == "aruco_mip_36h12":
        name = "ARUCO_MIP_36H12" if hasattr(cv2.aruco, "DICT_ARUCO_MIP_36H12") else "ARUCO_MIP_36h12"
    if not hasattr(cv2.aruco, f"DICT_{name}"):
        name = name.replace("H", "h", 1) if not name.startswith("ARUCO") else name
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
