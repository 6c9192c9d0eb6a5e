"""`markers survey`: relative poses from pictures, their sigmas, what is left out, and the file."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from tests.vision.survey_scene import LENS, SIX, camera_poses, pictures_of_six, turn_deg
from uasfly.bundle import Bundle
from uasfly.cli.main import app
from uasfly.errors import UasflyError
from uasfly.files import load_file
from uasfly.vision.bundle_survey.adjustment import Adjustment, Observation
from uasfly.vision.bundle_survey.bundle_file import bundle_text, write_bundle
from uasfly.vision.bundle_survey.start import first_marker_poses
from uasfly.vision.bundle_survey.survey import SurveyResult, survey_bundle
from uasfly.vision.bundle_survey.views import View, spread
from uasfly.vision.detectors import Detection
from uasfly.vision.pose import Pose
from uasfly.vision.rotations import right_jacobians, rotations

SIZES = {20: 0.15}


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    cv2.setNumThreads(1)


def synthetic_views(bundle: Bundle, count: int, sigma_px: float, seed: int = 3) -> list[View]:
    """Corners of all markers with noise, without any picture."""
    rng, views = np.random.default_rng(seed), []
    for index, pose in enumerate(camera_poses(count)):
        seen = {}
        for marker in bundle.markers:
            corners = LENS.project(pose.inverse.points(marker.corners)) + rng.normal(0.0, sigma_px, (4, 2))
            seen[marker.id] = Detection(marker.id, corners, sigma_px, True, 0.1)
        views.append(View(f"view {index}", seen))
    return views


def assert_close(result: SurveyResult, bundle: Bundle, metres: float, degrees: float) -> None:
    """Markers are where the bundle has them."""
    for marker in result.markers:
        truth = bundle.by_id[marker.marker_id]
        assert np.linalg.norm(marker.pose.position - truth.position) < metres
        assert turn_deg(marker.pose.rotation, truth.rotation) < degrees


def test_twelve_rendered_views_give_six_markers_to_a_tenth_of_a_millimetre(tmp_path: Path) -> None:
    """Through the command line, with pictures from disk; the file reads back as what was found."""
    for index, picture in enumerate(pictures_of_six()):
        cv2.imwrite(str(tmp_path / f"{index:02d}.png"), picture)
    lens, out = tmp_path / "camera.yaml", tmp_path / "board.yaml"
    with lens.open("w") as stream:
        YAML().dump(json.loads(LENS.model_dump_json(exclude_none=True)), stream)
    arguments = ["markers", "survey", str(tmp_path), "--camera", str(lens), "--size", "0.2", "--sizes", "20=0.15"]
    run = CliRunner().invoke(app, [*arguments, "--origin", "3", "--out", str(out), "--json"])
    assert run.exit_code == 0, run.output
    record = json.loads(run.stdout)
    assert record["origin"] == 3
    assert not record["left_out"]
    written = load_file(out, Bundle)
    assert [marker.id for marker in written.markers] == [3, 5, 8, 11, 12, 20]
    for marker, told in zip(written.markers, record["markers"], strict=True):
        truth = SIX.by_id[marker.id]
        assert np.linalg.norm(marker.position - truth.position) < 0.0002
        assert turn_deg(marker.rotation, truth.rotation) < 0.05
        assert marker.size_m == truth.size_m
        np.testing.assert_allclose(marker.position, told["position_m"], atol=1e-6)
    table = CliRunner().invoke(app, [*arguments, "--out", str(out)])
    assert table.exit_code == 0
    assert "12 of 12 pictures" in table.stdout


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    """Exactly, with sizes and left-out markers in the comments."""
    result = survey_bundle(synthetic_views(SIX, 8, 0.1), LENS, SIZES, 0.2, 3)
    result.left_out[77] = "seen with others in 1 pictures, expected 3"
    bundle = result.bundle("board", "36h11")
    write_bundle(tmp_path / "board.yaml", bundle_text(bundle, result, "lens", "2024-01-01"))
    assert load_file(tmp_path / "board.yaml", Bundle) == bundle
    text = (tmp_path / "board.yaml").read_text()
    assert "Left out: marker 77" in text
    assert "sigma x y z [mm]" in text


def test_sigmas_are_as_large_as_the_errors() -> None:
    """Normalised errors of all markers and seeds have a mean square near one."""
    squares = []
    for seed in range(6):
        result = survey_bundle(synthetic_views(SIX, 10, 0.25, seed), LENS, SIZES, 0.2, 3)
        for marker in result.markers[1:]:
            error = marker.pose.position - SIX.by_id[marker.marker_id].position
            squares.append((error / marker.position_sigma_m) ** 2)
    assert 0.6 < np.mean(squares) < 1.5


def test_the_jacobian_is_that_of_the_residuals() -> None:
    """Against central differences, away from the start, so that the rotations' curvature counts."""
    views = synthetic_views(SIX, 3, 0.2)
    observations = [Observation(i, m, d) for i, view in enumerate(views) for m, d in view.seen.items()]
    markers = {marker.id: Pose(marker.position, marker.unit_quaternion) for marker in SIX.markers}
    sizes = {marker.id: marker.size_m for marker in SIX.markers}
    adjustment = Adjustment(LENS, observations, markers, [p.inverse for p in camera_poses(3)], sizes, 3)
    x = np.random.default_rng(5).normal(0.0, 0.05, adjustment.size)
    exact, step = adjustment.jacobian(x).toarray(), 1e-6
    for column in range(adjustment.size):
        change = np.zeros(adjustment.size)
        change[column] = step
        slope = (adjustment.residuals(x + change) - adjustment.residuals(x - change)) / (2.0 * step)
        np.testing.assert_allclose(exact[:, column], slope, atol=1e-4 * max(1.0, np.abs(slope).max()))


def test_the_right_jacobian_is_that_of_the_exponential_map() -> None:
    """From no turn to nearly half a turn."""
    for size in (0.0, 1e-5, 0.3, 3.0):
        vector = size * np.array((0.48, -0.6, 0.64))
        for axis in np.eye(3):
            turn = rotations(vector).T @ (rotations(vector + 1e-6 * axis) - rotations(vector - 1e-6 * axis)) / 2e-6
            found = np.array((turn[2, 1], turn[0, 2], turn[1, 0]))
            np.testing.assert_allclose(right_jacobians(vector) @ axis, found, atol=1e-8)


def test_flat_markers_that_flip_are_put_right_by_the_other_views() -> None:
    """Noise of 0.6 px makes single markers flip; pairs seen from several sides do not."""
    views = synthetic_views(SIX, 12, 0.6)
    sizes = {marker.id: marker.size_m for marker in SIX.markers}
    for marker, pose in first_marker_poses(views, LENS, sizes, 3).items():
        assert turn_deg(pose.rotation, SIX.by_id[marker].rotation) < 8.0
    assert_close(survey_bundle(views, LENS, SIZES, 0.2, 3), SIX, 0.004, 0.8)


def test_wrong_detections_are_rejected_and_told() -> None:
    """Two pictures with a marker moved by 15 px or turned round."""
    views = synthetic_views(SIX, 10, 0.1)
    views[2].seen[8] = Detection(8, views[2].seen[8].corners + 15.0, 0.1, True, 0.1)
    views[5].seen[12] = Detection(12, np.roll(views[5].seen[12].corners, 1, axis=0), 0.1, True, 0.1)
    result = survey_bundle(views, LENS, SIZES, 0.2, 3)
    assert len(result.rejected) == 2
    assert result.rejected[0].startswith(("view 2: marker 8", "view 5: marker 12"))
    assert_close(result, SIX, 0.0005, 0.1)


def test_markers_that_are_seen_too_seldom_or_apart_are_left_out_and_told() -> None:
    """One that is in two pictures, and two that are never seen with the rest."""
    views = synthetic_views(SIX, 10, 0.1)
    for index, view in enumerate(views):
        if index > 1:
            del view.seen[20]
        for marker in (11, 12) if index % 2 else (3, 5, 8):
            view.seen.pop(marker)
    for view in views[:2]:
        view.seen.pop(11, None)
        view.seen.pop(12, None)
    result = survey_bundle(views, LENS, SIZES, 0.2, 3)
    assert [marker.marker_id for marker in result.markers] == [3, 5, 8]
    assert "2 pictures, expected 3" in result.left_out[20]
    assert "no chain" in result.left_out[11]
    assert "no chain" in result.left_out[12]


def test_the_frame_can_be_turned_to_the_plane_through_all_markers() -> None:
    """A flat board whose origin was measured: all z are then nothing."""
    flat = [{"id": i, "size_m": 0.2, "position_m": [0.3 * (i % 2), 0.3 * (i // 2), 0.0]} for i in range(4)]
    board = Bundle.model_validate({"name": "flat", "family": "36h11", "markers": flat})
    views = synthetic_views(board, 10, 0.3)
    turned = survey_bundle(views, LENS, {}, 0.2, 0, plane=True)
    plain = survey_bundle(views, LENS, {}, 0.2, 0)
    heights = [[abs(marker.pose.position[2]) for marker in result.markers] for result in (turned, plain)]
    assert max(heights[0]) < 0.5 * max(heights[1])
    assert_close(turned, board, 0.002, 0.5)


def test_a_video_of_one_place_gives_few_views() -> None:
    """Those that say the same are left."""
    views = synthetic_views(SIX, 6, 0.0)
    many = [view for view in views for _ in range(10)]
    assert len(spread(many, LENS, 60)) == 6
    assert len(spread(many, LENS, 4)) == 4


@pytest.mark.parametrize(("origin", "count", "words"), [(99, 8, "expected one of 3, 5, 8"), (3, 2, "needs pictures")])
def test_what_cannot_be_surveyed_says_why(origin: int, count: int, words: str) -> None:
    """An origin that is not there, too few pictures."""
    with pytest.raises(UasflyError, match=words):
        survey_bundle(synthetic_views(SIX, 8, 0.1)[:count], LENS, SIZES, 0.2, origin)


def test_a_wrong_size_is_told_on_the_command_line(tmp_path: Path) -> None:
    """Before any picture is looked at."""
    arguments = ["markers", "survey", str(tmp_path), "--camera", "vga", "--size", "0.2", "--sizes", "3:0.1"]
    run = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "b.yaml")])
    assert isinstance(run.exception, UasflyError)
    assert "ID=SIZE" in str(run.exception)
