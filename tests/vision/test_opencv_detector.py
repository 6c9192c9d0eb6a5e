"""OpenCV's detector in parts of a picture."""

from __future__ import annotations

import numpy as np

from uasfly.vision.opencv_detector import OpenCvDetector


def test_specks_are_no_candidates_in_a_small_part_of_a_picture() -> None:
    """A region full of dark specks holds nothing to be read: hundreds of candidates would take a second to refuse."""
    rng = np.random.default_rng(1)
    specks = np.kron((rng.uniform(size=(60, 60)) > 0.15).astype(np.uint8), np.ones((4, 4), dtype=np.uint8)) * np.uint8(
        200
    )
    detector = OpenCvDetector.of_family("36h11")
    assert detector.find(specks) == []
    _, _, refused = detector._detector.detectMarkers(specks)
    assert len(refused) < 30
