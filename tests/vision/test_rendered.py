"""Rendered markers: how exact poses are at 1, 3 and 5 m, and that every detector means the same corners."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.data import test_data
from tests.vision.scene import facing_rotation, render
from tests.vision.test_camera import camera
from tests.vision.test_pose import bundle, some_pose
from uasfly.camera import Camera
from uasfly.errors import FileError, UasflyError
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import Array
from uasfly.vision.bundle_pose import solve_bundle
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.detectors import Detector
from uasfly.vision.edges import fit_edges
from uasfly.vision.mounting import camera_in_body
from uasfly.vision.opencv_detector import OpenCvDetector
from uasfly.vision.pose import Pose
from uasfly.vision.region import predicted_region
from uasfly.vision.seek import detect_markers
from uasfly.vision.square import quaternion_of
from uasfly.vision.tracker import BundleTracker

BENT = camera([-0.25, 0.08, 0.0005, -0.0004, 0.0])


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    cv2.setNumThreads(1)


def _errors_m(name: str, distance_m: float, lens: Camera, pictures: int = 5, detector: Detector | None = None) -> Array:
    """Position errors (n,) m of a shipped bundle seen from a distance, with a prediction that is 2 degrees off."""
    rng, board = np.random.default_rng(int(distance_m)), bundle(name)
    detector = detector or make_detector("36h11")
    errors = []
    for _ in range(pictures):
        at = np.array((rng.uniform(-0.3, 0.3), rng.uniform(-0.06, 0.06), 1.0)) * distance_m
        pose = Pose(at, quaternion_of(facing_rotation(rng, 40.0)))
        image = render(board, lens, pose.rotation, pose.position, rng, pixels_per_m=1600.0)
        guess = pose.moved(np.concatenate((rng.normal(0, 0.05, 3), rng.normal(0, np.radians(2.0), 3))))
        sight = solve_bundle(board, lens, detect_markers(image, detector, lens), guess)
        assert sight.pose is not None
        assert len(sight.used) >= min(3, len(board.markers))  # a corner of the board may be out of sight
        assert not sight.left_out
        errors.append(np.linalg.norm(sight.pose.minus(pose)[:3]))
    return np.array(errors)


@pytest.mark.parametrize(("distance_m", "bound_m"), [(1.0, 0.001), (3.0, 0.005), (5.0, 0.03)])
def test_a_20_cm_marker_is_located_and_four_are_three_times_better(distance_m: float, bound_m: float) -> None:
    """Blur 0.9 px, noise 4 grey values, through a lens that bends lines."""
    alone = float(np.median(_errors_m("single_36h11", distance_m, BENT)))
    four = float(np.median(_errors_m("four_36h11", distance_m, BENT)))
    assert alone < bound_m / 3.0
    assert four < bound_m / 9.0


def test_fitted_lines_bring_corners_to_a_tenth_of_a_pixel_whatever_the_detector() -> None:
    """OpenCV and the AprilTag library give the same corners after it, in the same order, with the same half pixel."""
    rng, board = np.random.default_rng(2), bundle("four_36h11")
    pose = some_pose(rng, 2.5)
    image = render(board, BENT, pose.rotation, pose.position, rng)
    for library in ("opencv", "apriltag"):
        if library == "apriltag":
            pytest.importorskip("apriltag")
        detector = make_detector("36h11", library)
        found = detect_markers(image, detector, BENT)
        assert [detection.marker_id for detection in found] == [0, 1, 2, 3]
        for detection in found:
            truth = BENT.project(pose.points(board.corners(detection.marker_id)))
            assert detection.fitted
            assert np.abs(detection.corners - truth).max() < 0.1
        if library == "apriltag":  # as it is found, half a pixel would be seen
            rough = dict(detector.find(image))
            off = [rough[k] - BENT.project(pose.points(board.corners(k))) for k in range(4)]
            assert np.abs(np.mean(off, axis=(0, 1))).max() < 0.2


@pytest.mark.parametrize("family", ["25h9", "16h5"])
def test_every_apriltag_family_has_the_same_order_of_corners_in_both_libraries(family: str) -> None:
    """OpenCV prints them upside down, as the AprilTag library sees it."""
    pytest.importorskip("apriltag")
    shipped = bundle("four_36h11")
    board = shipped.model_validate({**shipped.model_dump(), "family": family})
    rng = np.random.default_rng(3)
    pose = some_pose(rng, 1.5, tilt_deg=20.0)
    image = render(board, BENT, pose.rotation, pose.position, rng)
    theirs, ours = (dict(make_detector(board.family, library).find(image)) for library in ("apriltag", "opencv"))
    for marker_id in range(4):
        assert np.abs(theirs[marker_id] - ours[marker_id]).max() < 2.0


def test_stag_corners_are_made_exact() -> None:
    """A marker of 160 px on a white page, corners known; the library's own are half a pixel inside."""
    pytest.importorskip("stag")
    marker = cv2.imread(str(test_data("data/stag_markers/HD21_00003.png")), cv2.IMREAD_GRAYSCALE)
    assert marker is not None
    small = cv2.resize(marker, None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA)
    page = cv2.copyMakeBorder(small, 100, 100, 100, 100, cv2.BORDER_CONSTANT, value=255)
    page = cv2.GaussianBlur(page, (0, 0), 0.8)
    upright, right = (np.asarray(it, dtype=np.uint8) for it in (page, cv2.rotate(page, cv2.ROTATE_90_CLOCKWISE)))
    truth = np.array(((119.5, 119.5), (279.5, 119.5), (279.5, 279.5), (119.5, 279.5)))
    (detection,) = detect_markers(upright, make_detector("stag_hd21"))
    assert detection.marker_id == 3
    np.testing.assert_allclose(detection.corners, truth, atol=0.1)
    (turned,) = detect_markers(right, make_detector("stag_hd21"))
    np.testing.assert_allclose(turned.corners, truth[[1, 2, 3, 0]], atol=0.1)


def test_edges_that_cannot_be_fitted_leave_the_corners_as_they_were() -> None:
    """A picture of nothing: no line, a sigma that says so."""
    corners = np.array([((40.0, 40.0), (80.0, 40.0), (80.0, 80.0), (40.0, 80.0))])
    fit = fit_edges(np.full((120, 160), 90, np.uint8), corners, 0.125)
    assert not fit.fitted[0]
    np.testing.assert_array_equal(fit.corners, corners)
    assert fit.sigma_px[0] > 0.5


def test_the_predicted_region_holds_the_bundle() -> None:
    """And is much smaller than the picture."""
    rng, board = np.random.default_rng(4), bundle("four_36h11")
    pose = some_pose(rng, 3.0)
    region = predicted_region(BENT, board, pose.moved(np.array((0.1, -0.1, 0.1, 0.05, 0.0, 0.05))), sigma_m=0.1)
    assert region is not None
    pixels = np.concatenate([BENT.project(pose.points(marker.corners)) for marker in board.markers])
    assert (pixels > (region.x + 5, region.y + 5)).all()
    assert (pixels < (region.x + region.width - 5, region.y + region.height - 5)).all()
    assert region.width * region.height < 0.4 * BENT.width_px * BENT.height_px


def test_the_tracker_looks_in_the_region_now_and_then_everywhere_and_everywhere_when_lost() -> None:
    """The same marker is found either way, to the same corners."""
    rng, board = np.random.default_rng(5), bundle("single_36h11")
    pose = some_pose(rng, 2.0)
    image = render(board, BENT, pose.rotation, pose.position, rng)
    in_body = camera_in_body(BENT).of_frame(pose)
    prediction = MarkerPrediction(in_body.position, in_body.quaternion, 0.05)
    tracker = BundleTracker(BENT, board)
    looks = [tracker.look(image, 0.1 * k, prediction) for k in range(20)]
    whole = [k for k, look in enumerate(looks) if look.region is None]
    assert whole == [0, 15]
    samples = [look.sample for look in looks]
    assert all(sample is not None for sample in samples)
    for k, sample in enumerate(samples):
        assert sample is not None
        assert sample.time_s == 0.1 * k
        np.testing.assert_allclose(sample.position_in_body, in_body.position, atol=0.002)
        np.testing.assert_allclose(sample.covariance, sample.covariance.T)
    empty = np.full_like(image, 100)
    lost = [tracker.look(empty, 2.0 + 0.1 * k, prediction) for k in range(4)]
    assert [look.region is None for look in lost] == [False, False, True, True]
    assert lost[-1].sample is None


def test_a_family_and_a_library_that_do_not_fit_are_refused() -> None:
    """With what would do."""
    with pytest.raises(UasflyError, match="expected the library stag"):
        make_detector("stag_hd21", "opencv")
    pytest.importorskip("apriltag")
    with pytest.raises(UasflyError, match="36h11, 25h9, 16h5"):
        make_detector("aruco_4x4_50", "apriltag")


def test_a_dictionary_file_without_a_dictionary_is_named(tmp_path: Path) -> None:
    """As is one that is not there."""
    path = tmp_path / "dictionary.yml"
    path.write_text("%YAML:1.0\n---\nnothing: 1\n")
    for wrong in (path, tmp_path / "nowhere.yml"):
        with pytest.raises(FileError, match=wrong.name):
            OpenCvDetector.from_file(wrong)
