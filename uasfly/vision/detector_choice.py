"""Which detector reads which family of markers; what is not chosen is not imported."""

from __future__ import annotations

from typing import Literal

from uasfly.bundle import Family
from uasfly.errors import UasflyError
from uasfly.vision.detectors import Detector

Library = Literal["auto", "opencv", "apriltag", "stag"]


def make_detector(family: Family, library: Library = "auto") -> Detector:
    """Detector of a family; `auto` takes OpenCV where it knows the family.

    Raises:
        UasflyError: the library does not know the family, or is not installed.
    """
    stag = family.startswith("stag_")
    chosen = ("stag" if stag else "opencv") if library == "auto" else library
    if stag != (chosen == "stag"):
        needed = "stag" if stag else "opencv or apriltag"
        raise UasflyError(f"markers {family}: expected the library {needed}, found {chosen}")
    if chosen == "stag":
        from uasfly.vision.stag_detector import StagDetector

        return StagDetector(family)
    if chosen == "apriltag":
        from uasfly.vision.apriltag_detector import AprilTagDetector

        return AprilTagDetector(family)
    from uasfly.vision.opencv_detector import OpenCvDetector

    return OpenCvDetector.of_family(family)
