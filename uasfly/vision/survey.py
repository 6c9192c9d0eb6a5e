"""What `uasfly markers detect` does with each picture: find, solve, draw, measure."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, get_args

import numpy as np

from uasfly.bundle import Bundle, Family
from uasfly.camera import Camera
from uasfly.errors import FileError, UasflyError
from uasfly.file_problems import did_you_mean
from uasfly.files import find_file, load_file
from uasfly.vision.bundle_pose import BundleSight, solve_bundle
from uasfly.vision.detector_choice import Library, make_detector
from uasfly.vision.detectors import Detection, Detector, Image
from uasfly.vision.mounting import marker_sample
from uasfly.vision.pictures import pictures
from uasfly.vision.seek import detect_markers
from uasfly.vision.stag_ros import find_bundle


def make_survey(
    bundle: str | None, family: str, dictionary: Path | None, camera: str | None, library: str, out: Path | None
) -> Survey:
    """A survey from what the command line says.

    Raises:
        UasflyError: a file cannot be used, a name is unknown, or a pose is wanted without a camera.
    """
    if library not in get_args(Library):
        raise UasflyError(f"--library: expected one of {', '.join(get_args(Library))}, found {library!r}")
    if bundle is not None and camera is None:
        raise UasflyError("--bundle: a pose needs the camera's intrinsics; give --camera NAME|FILE")
    if family not in get_args(Family):
        raise UasflyError(f"--family: no dictionary {family!r}; {did_you_mean(family, get_args(Family))}")
    board = None if bundle is None else find_bundle(bundle)
    lens = None if camera is None else load_file(find_file("camera", camera), Camera)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(str(out), [f"the folder for the pictures cannot be made: {error.strerror}"]) from None
    detector: Detector
    if dictionary is not None:
        from uasfly.vision.opencv_detector import OpenCvDetector

        detector = OpenCvDetector.from_file(dictionary)
    else:
        detector = make_detector(family if board is None else board.family, library)  # type: ignore[arg-type]
    return Survey(detector, board, lens, out)


class Survey:
    """Looks at pictures one by one, each on its own (nothing is predicted from the one before).

    Args:
        detector: what finds the markers.
        bundle: whose pose is wanted, None for none.
        camera: the lens, None where only ids and corners are wanted.
        out: folder of the pictures with the markers drawn in, None for none.
    """

    def __init__(self, detector: Detector, bundle: Bundle | None, camera: Camera | None, out: Path | None) -> None:
        self._detector, self._bundle, self._camera, self._out = detector, bundle, camera, out

    def look_at(self, source: str, most: int | None) -> list[dict[str, Any]]:
        """A record for each picture of a source.

        Raises:
            FileError: the source cannot be read, or a picture is not of the camera's size.
        """
        records = []
        for number, (name, image) in enumerate(pictures(source, most)):
            self._check_size(name, image)
            started = time.perf_counter()
            found = detect_markers(image, self._detector, self._camera)
            sight = None
            if self._bundle is not None and self._camera is not None:
                sight = solve_bundle(self._bundle, self._camera, found)
            elapsed = time.perf_counter() - started
            records.append(self._record(name, found, sight, elapsed))
            if self._out is not None:
                self._write(self._out / f"{Path(source).stem or 'camera'}_{number:05d}.png", image, found, sight)
        return records

    def summary(self, records: list[dict[str, Any]]) -> dict[str, Any]:
        """Counts and times of all records."""
        times = [record["ms"] for record in records]
        median = float(np.median(times)) if times else float("nan")
        return {
            "pictures": len(records),
            "with_markers": sum(bool(record["markers"]) for record in records),
            "with_pose": sum(record["pose"] is not None for record in records),
            "ms_median": round(median, 3),
            "ms_max": round(max(times, default=float("nan")), 3),
            "rate_hz": round(1000.0 / max(float(np.mean(times)), 1e-3), 1) if times else 0.0,
        }

    def _check_size(self, name: str, image: Image) -> None:
        if self._camera is None:
            return
        expected, found = (self._camera.width_px, self._camera.height_px), (image.shape[1], image.shape[0])
        if found != expected:
            size = f"{expected[0]} x {expected[1]} px (camera {self._camera.name}), found {found[0]} x {found[1]}"
            raise FileError(name, [f"expected {size}; give the camera file of this size"])

    def _record(self, name: str, found: list[Detection], sight: BundleSight | None, elapsed_s: float) -> dict[str, Any]:
        markers = [
            {"id": d.marker_id, "corners_px": np.round(d.corners, 3).tolist(), "sigma_px": round(d.sigma_px, 4)}
            for d in found
        ]
        left_out = [] if sight is None else sight.left_out
        return {
            "picture": name,
            "markers": markers,
            "pose": None if sight is None else self._pose(sight),
            "left_out": [{"id": e.marker_id, "reason": e.reason, "text": e.text} for e in left_out],
            "ms": round(1000.0 * elapsed_s, 3),
        }

    def _pose(self, sight: BundleSight) -> dict[str, Any] | None:
        if sight.pose is None or sight.covariance is None or self._camera is None or self._bundle is None:
            return None
        sample = marker_sample(self._camera, self._bundle.marker_id, 0.0, sight.pose, sight.covariance)
        sigma = np.sqrt(np.diag(sight.covariance))
        return {
            "position_in_camera_m": sight.pose.position.tolist(),
            "quaternion_bundle_to_camera": sight.pose.quaternion.tolist(),
            "position_sigma_m": sigma[:3].tolist(),
            "rotation_sigma_rad": sigma[3:].tolist(),
            "position_in_body_m": sample.position_in_body.tolist(),
            "quaternion_bundle_to_body": sample.quaternion_marker_to_body.tolist(),
            "used": list(sight.used),
            "residual_px": sight.residual_px,
            "ambiguous": sight.ambiguous,
        }

    def _write(self, path: Path, image: Image, found: list[Detection], sight: BundleSight | None) -> None:
        import cv2

        from uasfly.vision.drawing import annotated

        drawn = annotated(image, found, sight, self._camera)
        there, data = cv2.imencode(".png", drawn)
        try:
            if there:
                path.write_bytes(bytes(data))
        except OSError as error:
            raise FileError(str(path), [f"the picture cannot be written: {error.strerror}"]) from None
