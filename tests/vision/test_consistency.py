"""Markers that do not belong are left out, each with its reason; the pose stays good."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.vision.test_camera import camera
from tests.vision.test_pose import bundle, seen, some_pose
from uasfly.bundle import Bundle
from uasfly.messages import Array
from uasfly.vision.bundle_pose import BundleSight, solve_bundle
from uasfly.vision.detectors import Detection
from uasfly.vision.pose import Pose

LENS = camera()


def _with(changed: Callable[[Array], Array], number: int = 2, marker_id: int | None = None) -> tuple[Pose, BundleSight]:
    """Four markers at 2 m, the corners (4, 3) [m, bundle frame] of one of them changed."""
    rng, board = np.random.default_rng(4), bundle("four_36h11")
    pose = some_pose(rng, 2.0, tilt_deg=30.0)
    detections = seen(board, LENS, pose, rng, 0.05)
    corners = LENS.project(pose.points(changed(board.corners(number))))
    detections[number] = Detection(number if marker_id is None else marker_id, corners, 0.05, True, 0.1)
    return pose, solve_bundle(board, LENS, detections)


def _shifted(corners: Array) -> Array:
    return np.asarray(corners + np.array((0.03, 0.01, 0.0)))


def _smaller(corners: Array) -> Array:
    return np.asarray(corners.mean(axis=0) + 0.8 * (corners - corners.mean(axis=0)))


def _torn(corners: Array) -> Array:
    return np.asarray(corners + np.array(((0.0, 0.0, 0.0), (-0.05, -0.04, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))))


def _crossed(corners: Array) -> Array:
    return corners[[0, 2, 1, 3]]


def _turned(corners: Array) -> Array:
    return corners[[1, 2, 3, 0]]


@pytest.mark.parametrize(
    ("change", "reason", "words"),
    [
        (_shifted, "moved", "3.2 cm from its place"),
        (_smaller, "wrong size", "16.0 cm large, the file says 20.0"),
        (_torn, "torn", "px off"),
        (_crossed, "torn", "clockwise"),
        (_turned, "moved", "turned by"),
    ],
)
def test_a_marker_that_does_not_fit_is_left_out(change: Callable[[Array], Array], reason: str, words: str) -> None:
    """The others give the pose."""
    pose, sight = _with(change)
    assert sight.used == (0, 1, 3)
    (left_out,) = sight.left_out
    assert (left_out.marker_id, left_out.reason) == (2, reason)
    assert words in left_out.text
    assert sight.pose is not None
    assert np.linalg.norm(sight.pose.minus(pose)[:3]) < 0.003


def test_a_marker_with_anothers_number_is_told() -> None:
    """Marker 2 wears the number 3, so 3 is there twice: the one in its place is used."""
    _, sight = _with(lambda corners: corners, marker_id=3)
    assert sight.used == (0, 1, 3)
    assert [left_out.reason for left_out in sight.left_out] == ["seen twice"]


def test_a_wrong_number_is_told_by_its_place() -> None:
    """Marker 2 stands where marker 0 belongs, which is hidden."""
    rng, board = np.random.default_rng(9), bundle("four_36h11")
    pose = some_pose(rng, 2.0)
    detections = seen(board, LENS, pose, rng, 0.05)
    mistaken = Detection(2, detections[0].corners, 0.05, True, 0.1)
    sight = solve_bundle(board, LENS, [mistaken, detections[1], detections[3]], pose)
    assert sight.used == (1, 3)
    (left_out,) = sight.left_out
    assert (left_out.reason, "marker 0" in left_out.text) == ("wrong id", True)


def test_a_marker_of_no_bundle_is_left_out() -> None:
    """With its id."""
    _, sight = _with(lambda corners: corners, marker_id=77)
    assert sight.used == (0, 1, 3)
    assert sight.left_out[0].reason == "not in the bundle"


def test_two_markers_that_contradict_give_no_pose_without_a_prediction() -> None:
    """Nothing says which one has moved; a prediction does."""
    rng = np.random.default_rng(10)
    markers = [{"id": i, "size_m": 0.2, "position_m": (0.3 * i, 0.0, 0.0)} for i in range(2)]
    board = Bundle.model_validate({"name": "two", "family": "36h11", "markers": markers})
    pose = some_pose(rng, 2.0, tilt_deg=20.0)
    detections = seen(board, LENS, pose, rng, 0.05)
    moved = LENS.project(pose.points(board.corners(1) + np.array((0.05, 0.0, 0.0))))
    detections[1] = Detection(1, moved, 0.05, True, 0.1)
    assert solve_bundle(board, LENS, detections).pose is None
    sight = solve_bundle(board, LENS, detections, pose)
    assert sight.used == (0,)
    assert sight.left_out[0].marker_id == 1


def test_no_marker_gives_no_pose() -> None:
    """And no reason to leave one out."""
    sight = solve_bundle(bundle("four_36h11"), LENS, [])
    assert sight.pose is None
    assert sight.left_out == ()
