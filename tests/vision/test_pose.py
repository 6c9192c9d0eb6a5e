"""Poses: derivatives by finite differences, covariance by Monte Carlo, both ways a flat marker can be seen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.vision.scene import facing_rotation
from tests.vision.test_camera import DISTORTIONS, camera
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.files import find_file, load_file
from uasfly.messages import Array
from uasfly.vision.bundle_pose import solve_bundle
from uasfly.vision.detectors import Detection
from uasfly.vision.mounting import camera_in_body, covariance_in_body, marker_sample, pose_in_camera
from uasfly.vision.pose import Pose, pixel_residuals
from uasfly.vision.square import quaternion_of, square_poses, turn_between


def bundle(name: str) -> Bundle:
    """A shipped bundle."""
    return load_file(find_file("bundle", name), Bundle)


def some_pose(rng: np.random.Generator, distance_m: float, tilt_deg: float = 40.0) -> Pose:
    """A board in view, facing the camera."""
    at = np.array((rng.uniform(-0.3, 0.3), rng.uniform(-0.15, 0.15), 1.0)) * distance_m
    return Pose(at, quaternion_of(facing_rotation(rng, tilt_deg)))


def seen(board: Bundle, lens: Camera, pose: Pose, rng: np.random.Generator, sigma_px: float) -> list[Detection]:
    """Detections with white noise on the corners."""
    return [
        Detection(m.id, lens.project(pose.points(m.corners)) + rng.normal(0.0, sigma_px, (4, 2)), sigma_px, True, 0.0)
        for m in board.markers
    ]


@pytest.mark.parametrize("lens", [camera(d) for d in DISTORTIONS.values()], ids=list(DISTORTIONS))
def test_the_residuals_derivative_is_that_of_finite_differences(lens: Camera) -> None:
    """By the six numbers of the pose's error."""
    rng = np.random.default_rng(1)
    pose, points = some_pose(rng, 1.5), rng.uniform(-0.2, 0.2, (5, 3))
    pixels = rng.uniform(0, 700, (5, 2))
    _, jacobian = pixel_residuals(lens, pose, points, pixels)
    for axis in range(6):
        step = 1e-6 * np.eye(6)[axis]
        ahead, _ = pixel_residuals(lens, pose.moved(step), points, pixels)
        back, _ = pixel_residuals(lens, pose.moved(-step), points, pixels)
        np.testing.assert_allclose(jacobian[:, :, axis], (back - ahead) / 2e-6, rtol=1e-5, atol=2e-3)


def test_minus_undoes_moved() -> None:
    """The error's definition is MarkerSample's: true = estimate * exp(error)."""
    rng = np.random.default_rng(2)
    pose, error = some_pose(rng, 2.0), rng.normal(0.0, 0.3, 6)
    np.testing.assert_allclose(pose.moved(error).minus(pose), error, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "distance_m", "sigma_px"), [("single_36h11", 1.0, 0.2), ("four_36h11", 1.0, 0.3), ("four_36h11", 4.0, 0.2)]
)
def test_the_stated_covariance_is_the_errors(name: str, distance_m: float, sigma_px: float) -> None:
    """NEES of seeded poses with known corner noise lies inside the 95 % chi-square bounds."""
    rng, board, lens = np.random.default_rng(7), bundle(name), camera([-0.2, 0.05, 0.0, 0.0])
    nees = []
    for _ in range(150):
        pose = some_pose(rng, distance_m)
        sight = solve_bundle(board, lens, seen(board, lens, pose, rng, sigma_px), pose)
        assert sight.pose is not None
        assert sight.covariance is not None
        error = pose.minus(sight.pose)
        nees.append(error @ np.linalg.solve(sight.covariance, error))
    low, high = chi2.ppf((0.025, 0.975), 6 * len(nees)) / len(nees)
    assert low < np.mean(nees) < high


def test_the_covariance_follows_the_residual_where_corners_are_worse_than_stated() -> None:
    """Nine markers with three times the stated noise: sigmas are nearly three times the stated ones."""
    rng, lens = np.random.default_rng(3), camera()
    places = [((column - 1) * 0.1, (row - 1) * 0.1, 0.0) for row in range(3) for column in range(3)]
    markers = [{"id": i, "size_m": 0.06, "position_m": place} for i, place in enumerate(places)]
    board = Bundle.model_validate({"name": "nine", "family": "36h11", "markers": markers})
    pose = some_pose(rng, 1.0)
    noisy = [Detection(d.marker_id, d.corners, 0.2, True, 0.0) for d in seen(board, lens, pose, rng, 0.6)]
    quiet = seen(board, lens, pose, rng, 0.2)
    sigmas = []
    for detections in (noisy, quiet):
        covariance = solve_bundle(board, lens, detections, pose).covariance
        assert covariance is not None
        sigmas.append(np.sqrt(np.diag(covariance)))
    ratio = float(np.mean(sigmas[0] / sigmas[1]))
    assert 2.0 < ratio < 3.5


def test_a_prediction_tells_the_two_poses_of_a_small_marker_apart() -> None:
    """Without it, a fifth of them or more are flipped; with one that is 4 degrees off, none."""
    rng, board, lens = np.random.default_rng(5), bundle("single_36h11"), camera()
    alone, predicted, doubtful = 0, 0, 0
    for _ in range(60):
        pose = some_pose(rng, 8.0)
        detections = seen(board, lens, pose, rng, 0.25)
        guess = pose.moved(np.concatenate((rng.normal(0, 0.1, 3), rng.normal(0, np.radians(4.0 / 3**0.5), 3))))
        free, bound = solve_bundle(board, lens, detections), solve_bundle(board, lens, detections, guess)
        assert free.pose is not None
        assert bound.pose is not None
        assert free.covariance is not None
        flipped = turn_between(free.pose, pose) > np.radians(25.0)
        alone += flipped
        if flipped:
            doubtful += free.ambiguous
        predicted += turn_between(bound.pose, pose) > np.radians(25.0)
    assert alone >= 6
    assert doubtful >= 0.7 * alone  # it knows that it may be wrong
    assert predicted == 0


def test_a_square_has_two_poses_and_one_of_them_is_right() -> None:
    """Found from exact corners, the better one comes first."""
    rng, lens = np.random.default_rng(6), camera()
    board = bundle("single_36h11")
    for _ in range(10):
        pose = some_pose(rng, 2.0)
        poses = square_poses(lens.normalise(lens.project(pose.points(board.corners(0)))), 0.2)
        np.testing.assert_allclose(poses[0][0].minus(pose), 0.0, atol=1e-4)


def test_the_mounting_takes_poses_to_the_body_and_back() -> None:
    """A marker 2 m ahead of a camera that looks ahead, 10 cm in front of the body's origin, faces the body."""
    lens = camera(mounting_sigma_m=0.0, mounting_sigma_deg=0.0)
    ahead = Pose(np.array((0.0, 0.0, 2.0)), quaternion_of(np.diag((1.0, -1.0, -1.0))))
    sample = marker_sample(lens, 3, 12.5, ahead, np.eye(6))
    np.testing.assert_allclose(sample.position_in_body, (2.1, 0.0, 0.0), atol=1e-12)
    back = pose_in_camera(lens, sample.position_in_body, sample.quaternion_marker_to_body)
    np.testing.assert_allclose(back.minus(ahead), 0.0, atol=1e-9)
    out_of_page = Pose(sample.position_in_body, sample.quaternion_marker_to_body).rotation[:, 2]
    np.testing.assert_allclose(out_of_page, (-1.0, 0.0, 0.0), atol=1e-12)


def test_an_uncertain_mounting_is_in_the_covariance() -> None:
    """As it is in a thousand mountings."""
    rng = np.random.default_rng(8)
    lens = camera(mounting_sigma_m=0.01, mounting_sigma_deg=1.0)
    pose, true = some_pose(rng, 3.0), camera_in_body(lens)
    nominal = true.of_frame(pose)
    errors = []
    for _ in range(4000):
        turn = np.concatenate((rng.normal(0, 0.01, 3), rng.normal(0, np.radians(1.0), 3)))
        errors.append(true.moved(turn).of_frame(pose).minus(nominal))
    stated: Array = covariance_in_body(lens, pose, np.zeros((6, 6)))
    np.testing.assert_allclose(
        np.cov(np.array(errors).T), stated, atol=0.08 * np.sqrt(np.outer(*2 * [stated.diagonal()])).max()
    )
