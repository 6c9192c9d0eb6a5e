"""From a picture to detections: the detector in the region, then the edges in the whole picture."""

from __future__ import annotations

import numpy as np

from uasfly.camera import Camera
from uasfly.vision.detectors import Detection, Detector, Image, Region, grey_picture
from uasfly.vision.edges import fit_edges


def detect_markers(
    image: Image, detector: Detector, camera: Camera | None = None, region: Region | None = None
) -> list[Detection]:
    """Markers in a picture, by id and then from left to right.

    Args:
        image: (h, w) grey or (h, w, 3) blue-green-red, uint8.
        detector: of the family that is looked for.
        camera: its lens bends edges; they are taken as straight where it is not given.
        region: where to look; the whole picture where not given.
    """
    grey = grey_picture(image)
    part = grey if region is None else region.crop(grey)
    found = detector.find(np.ascontiguousarray(part)) if min(part.shape) >= 16 else []
    if not found:
        return []
    corners = np.array([quad for _, quad in found])
    if region is not None:
        corners += np.array((region.x, region.y))
    fit = fit_edges(grey, corners, detector.border, camera)
    detections = [
        Detection(marker_id, fit.corners[i], float(fit.sigma_px[i]), bool(fit.fitted[i]), float(fit.straightness_px[i]))
        for i, (marker_id, _) in enumerate(found)
    ]
    return sorted(detections, key=lambda detection: (detection.marker_id, float(detection.corners[0, 0])))
