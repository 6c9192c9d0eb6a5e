"""One bundle from picture to picture: region, detection, pose, and the sample for the filter. No clock, no files."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import MarkerSample
from uasfly.vision.bundle_pose import BundleSight, solve_bundle
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.detectors import Detection, Detector, Image, Region
from uasfly.vision.mounting import marker_sample, pose_in_camera
from uasfly.vision.region import RegionPlan
from uasfly.vision.seek import detect_markers


@dataclass(frozen=True, slots=True)
class Look:
    """What one picture gave.

    Attributes:
        sample: for the filter; None where the bundle has no pose.
        sight: the pose in camera axes, the markers used and those left out.
        detections: every marker of the family that was found.
        region: where it was looked for; None for the whole picture.
    """

    sample: MarkerSample | None
    sight: BundleSight
    detections: tuple[Detection, ...]
    region: Region | None


class BundleTracker:
    """Follows one bundle.

    Args:
        camera: lens and mounting.
        bundle: the markers.
        detector: the family's own when not given.
        plan: when whole pictures are searched.
    """

    def __init__(
        self, camera: Camera, bundle: Bundle, detector: Detector | None = None, plan: RegionPlan | None = None
    ) -> None:
        self._camera = camera
        self._bundle = bundle
        self._detector = make_detector(bundle.family) if detector is None else detector
        self._plan = RegionPlan() if plan is None else plan

    def look(self, image: Image, time_s: float, prediction: MarkerPrediction | None = None) -> Look:
        """Find the bundle in a picture.

        Args:
            image: (h, w) grey or (h, w, 3) blue-green-red, uint8, of the camera's size.
            time_s: middle of its exposure, host's clock.
            prediction: where the filter expects the bundle at that time.
        """
        expected, sigma_m = None, 0.1
        if prediction is not None:
            at, turned = prediction.position_in_body, prediction.quaternion_marker_to_body
            expected, sigma_m = pose_in_camera(self._camera, at, turned), prediction.sigma_m
        region = self._plan.next(self._camera, self._bundle, expected, sigma_m)
        detections = detect_markers(image, self._detector, self._camera, region)
        sight = solve_bundle(self._bundle, self._camera, detections, expected)
        self._plan.found(sight.pose is not None)
        sample = None
        if sight.pose is not None and sight.covariance is not None:
            sample = marker_sample(self._camera, self._bundle.marker_id, time_s, sight.pose, sight.covariance)
        return Look(sample, sight, tuple(detections), region)
