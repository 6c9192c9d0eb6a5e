"""Printed pages: to scale on paper, tiled without gaps, and read back by the detector at the right size."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.data import test_data
from tests.vision.test_pose import bundle
from uasfly.bundle import Bundle
from uasfly.cli.main import app
from uasfly.errors import FileError, UasflyError
from uasfly.vision.detector_choice import make_detector
from uasfly.vision.detectors import Image
from uasfly.vision.printing import draw_page
from uasfly.vision.seek import detect_markers
from uasfly.vision.sheets import PAPERS_MM, Page, bundle_sheet, marker_sheets, pages_of
from uasfly.vision.stag_ros import find_bundle, read_stag_ros

DPI = 100.0


def _picture(page: Page, paper: str, path: Path) -> Image:
    draw_page(page, paper).savefig(path, dpi=DPI)  # type: ignore[arg-type]
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def _board(size_m: float, places: list[tuple[float, float]]) -> Bundle:
    markers = [{"id": i, "size_m": size_m, "position_m": (*place, 0.0)} for i, place in enumerate(places)]
    return Bundle.model_validate({"name": "board", "family": "36h11", "markers": markers})


def test_a_printed_marker_has_its_size_and_its_ruler_too(tmp_path: Path) -> None:
    """Seen by the detector in the page at 100 dpi: 120 mm are 472.44 px, and upright."""
    (page,) = pages_of(marker_sheets(_board(0.12, [(0.0, 0.0)])), "a4")
    image = _picture(page, "a4", tmp_path / "page.png")
    assert image.shape == (int(297 / 25.4 * DPI), int(210 / 25.4 * DPI))
    (detection,) = detect_markers(image, make_detector("36h11"))
    edges = np.roll(detection.corners, -1, axis=0) - detection.corners
    np.testing.assert_allclose(edges[0], (120.0 / 25.4 * DPI, 0.0), atol=0.7)
    np.testing.assert_allclose(np.linalg.norm(edges, axis=1), 120.0 / 25.4 * DPI, atol=0.7)
    low = image[-round(17.0 / 25.4 * DPI) : -round(15.0 / 25.4 * DPI)]  # the ruler's line
    dark = np.flatnonzero(low.min(axis=0) < 200)
    assert dark[-1] - dark[0] == pytest.approx(100.0 / 25.4 * DPI, abs=2.5)


def test_tiles_joined_at_their_cut_marks_are_the_whole_board(tmp_path: Path) -> None:
    """Four markers of 12 cm on A4: pages are cut, put together, and every marker is found in its place."""
    board = _board(0.12, [(-0.09, 0.09), (0.09, 0.09), (-0.09, -0.09), (0.09, -0.09)])
    sheet = bundle_sheet(board)
    pages = pages_of([sheet], "a4")
    assert (pages[0].rows, pages[0].columns) == (2, 2)
    per_mm = DPI / 25.4
    canvas = np.full((round(sheet.height_mm * per_mm) + 2, round(sheet.width_mm * per_mm) + 2), 255, np.uint8)
    for number, page in enumerate(pages):
        image = _picture(page, "a4", tmp_path / f"{number}.png")
        top = image.shape[0] - round((page.bottom + page.height) * per_mm)
        left, height, width = round(page.left * per_mm), round(page.height * per_mm), round(page.width * per_mm)
        y, x = round((sheet.height_mm - page.y - page.height) * per_mm), round(page.x * per_mm)
        canvas[y : y + height, x : x + width] = image[top : top + height, left : left + width]
    found = {d.marker_id: d.corners.mean(axis=0) for d in detect_markers(canvas, make_detector("36h11"))}
    assert sorted(found) == [0, 1, 2, 3]
    np.testing.assert_allclose((found[1] - found[0]) / per_mm, (180.0, 0.0), atol=0.6)
    np.testing.assert_allclose((found[2] - found[0]) / per_mm, (0.0, 180.0), atol=0.6)


def test_a_turned_marker_is_not_printed_on_a_board() -> None:
    """It says which one and what to do."""
    markers = [{"id": 4, "size_m": 0.1, "rpy_deg": (0.0, 90.0, 0.0)}]
    cube = Bundle.model_validate({"name": "cube", "family": "36h11", "markers": markers})
    with pytest.raises(UasflyError, match=r"marker 4 is turned.*one by one"):
        bundle_sheet(cube)


@pytest.mark.parametrize("paper", list(PAPERS_MM))
def test_the_command_writes_pages_of_the_papers_size(tmp_path: Path, paper: str) -> None:
    """MediaBox, in points."""
    out = tmp_path / "markers.pdf"
    command = ["markers", "print", "--ids", "0-1,5", "--size-cm", "10", "--paper", paper, "--out", str(out), "--json"]
    result = CliRunner().invoke(app, command, catch_exceptions=False)
    assert result.exit_code == 0
    assert [page["sheet"] for page in json.loads(result.stdout)["pages"]] == [
        f"36h11 id {number}, 100 mm" for number in (0, 1, 5)
    ]
    boxes = re.findall(rb"/MediaBox \[ 0 0 ([0-9.]+) ([0-9.]+) \]", out.read_bytes())
    assert len(boxes) == 3
    for box in boxes:
        np.testing.assert_allclose([float(value) / 72.0 * 25.4 for value in box], PAPERS_MM[paper], atol=0.01)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--ids", "7-3"], "growing order"),
        (["--ids", "x"], "numbers and ranges"),
        (["--ids", "900"], "expected an id from 0 to 586, found 900"),
        (["--family", "36h12"], "expected one of 36h11"),
        (["--paper", "a5"], "expected one of a4, a3, letter"),
        (["--bundle", "nowhere"], "there is no bundle of this name"),
    ],
)
def test_what_cannot_be_printed_is_told(tmp_path: Path, flags: list[str], words: str) -> None:
    """Before anything is written."""
    out = tmp_path / "markers.pdf"
    with pytest.raises(UasflyError, match=re.escape(words)):
        CliRunner().invoke(app, ["markers", "print", *flags, "--out", str(out)], catch_exceptions=False)
    assert not out.exists()


def test_the_command_finds_markers_and_draws_them(tmp_path: Path) -> None:
    """A folder with two pictures: ids, pose in camera and body, and a picture each."""
    camera = tmp_path / "camera.yaml"
    camera.write_text(
        "{name: flat, width_px: 826, height_px: 1169, fx: 900, fy: 900, cx: 413, cy: 584, transform_camera_to_body: {}}"
    )
    board = tmp_path / "board.yaml"
    board.write_text("{name: one, family: 36h11, markers: [{id: 0, size_m: 0.12}]}")
    folder = tmp_path / "pictures"
    folder.mkdir()
    (page,) = pages_of(marker_sheets(_board(0.12, [(0.0, 0.0)])), "a4")
    _picture(page, "a4", folder / "a.png")
    cv2.imwrite(str(folder / "b.png"), np.full((1169, 826), 128, np.uint8))
    out = tmp_path / "found"
    command = ["markers", "detect", str(folder), "--bundle", str(board), "--camera", str(camera), "--out", str(out)]
    result = CliRunner().invoke(app, [*command, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    report = json.loads(result.stdout)
    first, second = report["pictures"]
    assert [marker["id"] for marker in first["markers"]] == [0]
    assert first["pose"]["position_in_camera_m"][2] == pytest.approx(900 * 120 / (120 / 25.4 * DPI) / 1000, rel=0.003)
    assert second["markers"] == []
    assert second["pose"] is None
    assert (report["summary"]["pictures"], report["summary"]["with_pose"]) == (2, 1)
    assert len(list(out.glob("*.png"))) == 2
    table = CliRunner().invoke(app, command, catch_exceptions=False)
    assert "2 pictures, 1 with markers, 1 with a pose" in table.stdout


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: path.write_bytes(b"no picture"), "cannot be decoded"),
        (lambda path: path.write_bytes(b""), "cannot be decoded"),
        (lambda path: None, "cannot be read"),
    ],
)
def test_a_bad_picture_is_named(tmp_path: Path, make: object, words: str) -> None:
    """Exit code 2 by the command line's own rule for UasflyError."""
    path = tmp_path / "broken.png"
    make(path)  # type: ignore[operator]
    with pytest.raises(FileError, match=rf"broken\.png.*{words}"):
        CliRunner().invoke(app, ["markers", "detect", str(path)], catch_exceptions=False)


def test_bundle_files_of_stag_ros_are_read() -> None:
    """Four tags of 89 mm; two tags of 118 mm; a single tag of 161 mm."""
    (four,) = read_stag_ros(test_data("data/fiducials/stag_ros_bundle_config_4.yaml"))
    assert (four.name, four.family, sorted(four.by_id)) == ("bundle_4", "stag_hd15", [76, 92, 103, 138])
    np.testing.assert_allclose(
        four.corners(76), ((-0.1, 0.095, 0), (-0.011, 0.095, 0), (-0.011, 0.006, 0), (-0.1, 0.006, 0)), atol=1e-9
    )
    (two,) = read_stag_ros(test_data("data/fiducials/stag_ros_bundle_config_2.yaml"), library_hd=15)
    assert [marker.size_m for marker in two.markers] == pytest.approx([0.118, 0.118])
    assert find_bundle(str(test_data("data/fiducials/stag_ros_bundle_config_4.yaml"))) == four
    (single,) = read_stag_ros(test_data("data/fiducials/stag_ros_single_config.yaml"), library_hd=21)
    assert (single.name, single.family) == ("tag_7", "stag_hd21")
    assert single.markers[0].size_m == pytest.approx(0.161)


def test_a_tag_that_is_no_square_is_named(tmp_path: Path) -> None:
    """With bundle and id."""
    path = tmp_path / "bundle.yaml"
    path.write_text('{bundles: [{frame: "wall", tags: [{id: 3, corners: [[0, 0, 0], [0.1, 0, 0], [0.1, -0.2, 0]]}]}]}')
    with pytest.raises(FileError, match=r"wall, tag 3: its corners are no square"):
        read_stag_ros(path)


def test_the_shipped_board_is_printed_whole() -> None:
    """Its sheet is 65 cm by 65 cm, white margin included."""
    sheet = bundle_sheet(bundle("four_36h11"))
    assert (sheet.width_mm, sheet.height_mm) == pytest.approx((650.0, 650.0))
