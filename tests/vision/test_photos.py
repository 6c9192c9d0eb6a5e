"""Photos by others: every marker in them is found and nothing else, and poses agree with the board's."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.data import test_data
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.vision.bundle_pose import solve_bundle
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.detectors import Image
from uasfly.vision.opencv_detector import OpenCvDetector
from uasfly.vision.pose import Pose
from uasfly.vision.seek import detect_markers
from uasfly.vision.square import quaternion_of, turn_between

SQUARES, SQUARE_M, MARKER_M = (5, 7), 0.04, 0.02


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    cv2.setNumThreads(1)


def _photo(name: str) -> Image:
    return np.asarray(cv2.imread(str(test_data(f"data/fiducials/{name}"))), dtype=np.uint8)


@pytest.mark.parametrize(
    ("name", "family", "ids"),
    [
        ("ocv_singlemarkersoriginal.jpg", "aruco_6x6_250", [23, 40, 62, 98, 124, 203]),
        ("ocv_charuco_img_00.jpg", "aruco_6x6_250", list(range(17))),
        ("ocv_charuco_img_01.jpg", "aruco_6x6_250", list(range(17))),
        ("stag_python_example_HD21.jpg", "stag_hd21", [1, 2, 3, 4, 5, 6, 7]),
        ("stag_ros_usrl_1_HD15.jpg", "stag_hd15", [1]),
        ("stag_python_example_HD21.jpg", "36h11", []),
        ("stag_ros_usrl_1_HD15.jpg", "aruco_6x6_250", []),
        ("ocv_gboriginal.jpg", "36h11", []),
    ],
)
def test_all_ids_and_no_false_ones(name: str, family: str, ids: list[int]) -> None:
    """In colour, as cameras give them."""
    if family.startswith("stag"):
        pytest.importorskip("stag")
    detector = make_detector(family)  # type: ignore[arg-type]
    assert [detection.marker_id for detection in detect_markers(_photo(name), detector)] == ids


def test_a_grid_of_a_dictionary_from_a_file_is_found_whole() -> None:
    """5 x 7 markers of OpenCV's tutorial."""
    detector = OpenCvDetector.from_file(test_data("data/fiducials/ocv_tutorial_dict.yml"))
    found = detect_markers(_photo("ocv_gboriginal.jpg"), detector)
    assert [detection.marker_id for detection in found] == list(range(35))


def _charuco_camera() -> Camera:
    storage = cv2.FileStorage(str(test_data("data/fiducials/ocv_tutorial_camera_charuco.yml")), cv2.FILE_STORAGE_READ)
    matrix = storage.getNode("camera_matrix").mat()
    fields = {
        "name": "charuco", "width_px": 640, "height_px": 480, "fx": matrix[0, 0], "fy": matrix[1, 1],
        "cx": matrix[0, 2], "cy": matrix[1, 2], "transform_camera_to_body": {},
        "distortion": storage.getNode("distortion_coefficients").mat().ravel().tolist(),
    }  # fmt: skip
    return Camera.model_validate(fields)


@pytest.mark.parametrize("name", ["ocv_charuco_img_00.jpg", "ocv_charuco_img_01.jpg"])
def test_markers_of_2_cm_agree_with_the_chessboard_that_they_are_in(name: str) -> None:
    """Truth is the pose of the chessboard's corners; one marker <= 0.5 cm and no flips, all of them <= 0.08 cm."""
    lens, image, rng = _charuco_camera(), _photo(name), np.random.default_rng(1)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    board = cv2.aruco.CharucoBoard(SQUARES, SQUARE_M, MARKER_M, dictionary)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
    points = np.asarray(board.getChessboardCorners())[np.asarray(numbers).ravel()]
    _, turned, at = cv2.solvePnP(points, corners, lens.matrix, lens.coefficients)
    to_page = np.diag((1.0, -1.0, -1.0))  # OpenCV's board has y down and z into the page
    rotation = np.asarray(cv2.Rodrigues(turned)[0] @ to_page, dtype=float)
    truth = Pose(np.asarray(at, dtype=float).ravel(), quaternion_of(rotation))
    centres = [np.mean(quad, axis=0) @ to_page for quad in board.getObjPoints()]
    markers = [
        {"id": int(marker_id), "size_m": MARKER_M, "position_m": centre.tolist()}
        for marker_id, centre in zip(np.asarray(board.getIds()).ravel(), centres, strict=True)
    ]
    whole = Bundle.model_validate({"name": "board", "family": "aruco_6x6_250", "markers": markers})
    detections = detect_markers(image, make_detector("aruco_6x6_250"), lens)
    errors = []
    for detection in detections:
        marker = whole.by_id[detection.marker_id]
        alone = {"name": "one", "family": "aruco_6x6_250", "markers": [{"id": marker.id, "size_m": MARKER_M}]}
        expected = truth.of_frame(Pose(marker.position, marker.unit_quaternion))
        guess = expected.moved(np.concatenate((rng.normal(0, 0.02, 3), rng.normal(0, np.radians(3.0), 3))))
        sight = solve_bundle(Bundle.model_validate(alone), lens, [detection], guess)
        assert sight.pose is not None
        errors.append(np.linalg.norm(sight.pose.minus(expected)[:3]))
        assert turn_between(sight.pose, expected) < np.radians(20.0)
    assert len(errors) == 17
    assert np.median(errors) < 0.005
    sight = solve_bundle(whole, lens, detections)
    assert sight.pose is not None
    assert not sight.left_out
    assert np.linalg.norm(sight.pose.minus(truth)[:3]) < 0.0008
