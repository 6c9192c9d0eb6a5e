"""`uasfly calibrate`: a lens from rendered views of a board, hints, sigmas, refusals, the file, the printed board."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from tests.data import test_data
from tests.vision.charuco_scene import BOARD, TRUE, charuco_views, texture_of
from uasfly.camera import Camera
from uasfly.cli.coverage_view import collect_live, coverage_text
from uasfly.cli.main import app
from uasfly.errors import UasflyError
from uasfly.files import load_file
from uasfly.messages import Array
from uasfly.vision.calibration.board import BoardView, CharucoBoard
from uasfly.vision.calibration.camera_file import FRESH, with_fields, write_camera
from uasfly.vision.calibration.coverage import coverage, is_new, place_of, spread
from uasfly.vision.calibration.lens import Lens, LensModel, calibrate_lens
from uasfly.vision.detectors import Image
from uasfly.vision.frames import Announcement, Frame
from uasfly.vision.rotations import rotations

SIZE = (TRUE.width_px, TRUE.height_px)
TEXT = "charuco:9x6:0.04:0.03:4x4_50"


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    cv2.setNumThreads(1)


def synthetic_views(camera: Camera, count: int, sigma_px: float, tilt: float = 0.6) -> list[BoardView]:
    """Corners with noise, without any picture; those outside of it are not seen."""
    rng, grid = np.random.default_rng(1), np.asarray(BOARD.opencv.getChessboardCorners(), dtype=float)
    views: list[BoardView] = []
    reach = 0.12 if camera.model == "pinhole" else 0.4
    while len(views) < count:
        turn = rotations(rng.uniform(-tilt, tilt, 3))
        points = (grid - grid.mean(axis=0)) @ turn.T + rng.uniform(
            (-reach, -0.7 * reach, 0.3), (reach, 0.7 * reach, 0.6)
        )
        pixels = camera.project(points)
        inside = ((pixels > 0.0) & (pixels < (camera.width_px, camera.height_px))).all(axis=1)
        if inside.sum() > 12:
            noise = rng.normal(0.0, sigma_px, pixels.shape)
            views.append(BoardView(f"view {len(views)}", grid[inside], (pixels + noise)[inside]))
    return views


def undistortion_error_px(found: Camera, truth: Camera) -> float:
    """RMS distance of undistorted pixels from truly undistorted ones; scale and shift belong to the matrix."""
    u, v = np.meshgrid(np.linspace(5, truth.width_px - 6, 24), np.linspace(5, truth.height_px - 6, 18))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    ours, theirs = (lens.normalise(pixels) * (lens.fx, lens.fy) for lens in (found, truth))
    error = []
    for axis in (0, 1):
        line = np.polynomial.Polynomial.fit(ours[:, axis], theirs[:, axis], 1)
        error.append(theirs[:, axis] - line(ours[:, axis]))
    return float(np.sqrt((np.array(error) ** 2).sum(axis=0).mean()))


def test_rendered_views_give_the_lens_back(tmp_path: Path) -> None:
    """Focal lengths to 0.03 %, principal point to 0.5 px, distortion to 0.03 px; the file keeps what it had."""
    for index, picture in enumerate(charuco_views()):
        cv2.imwrite(str(tmp_path / f"{index:02d}.png"), picture)
    out = tmp_path / "out" / "camera.yaml"
    out.parent.mkdir()
    out.write_text(FRESH.replace("[0.0, 0.0, 0.0]", "[0.12, 0.0, -0.03]  # measured"))
    arguments = ["calibrate", str(tmp_path), "--board", TEXT, "--out", str(out)]
    run = CliRunner().invoke(app, [*arguments, "--json"])
    assert run.exit_code == 0, run.output
    record, camera = json.loads(run.stdout), load_file(out, Camera)
    assert abs(camera.fx / TRUE.fx - 1.0) < 0.0003
    assert abs(camera.fy / TRUE.fy - 1.0) < 0.0003
    assert np.hypot(camera.cx - TRUE.cx, camera.cy - TRUE.cy) < 0.5
    assert undistortion_error_px(camera, TRUE) < 0.03
    assert record["rms_px"] < 0.06
    assert record["hold_out_px"] < 0.06
    assert abs(camera.fx - TRUE.fx) < 4.0 * record["sigmas"]["fx"]
    assert camera.transform_camera_to_body.position_m == (0.12, 0.0, -0.03)
    text = out.read_text()
    assert text.startswith("# lens: calibrated on ")
    assert "# measured" in text
    assert cv2.imread(str(out.with_suffix(".png"))) is not None
    again = CliRunner().invoke(app, arguments)
    assert again.exit_code == 0
    assert "views that the lens was not fitted to" in again.stdout
    assert out.read_text() == text


@pytest.mark.parametrize("name", ["two photos"])
def test_two_pictures_are_refused_with_the_reason(name: str, tmp_path: Path) -> None:
    """Photos by others, of a board that is found whole in both."""
    photos = [str(test_data(f"data/fiducials/ocv_charuco_img_0{index}.jpg")) for index in (0, 1)]
    arguments = ["calibrate", *photos, "--board", "charuco:5x7:0.04:0.02:6x6_250", "--out", str(tmp_path / "c.yaml")]
    run = CliRunner().invoke(app, arguments)
    assert isinstance(run.exception, UasflyError)
    assert "too few views: expected 8 or more" in str(run.exception)
    assert "found 2; take 15 to 40" in str(run.exception)
    assert not (tmp_path / "c.yaml").exists()


@pytest.mark.parametrize("model", ["4", "5", "8", "fisheye"])
def test_every_model_comes_back_from_its_own_corners(model: LensModel) -> None:
    """With noise of a tenth of a pixel; sigmas are as large as the errors."""
    fields = TRUE.model_dump()
    bent = {
        "4": [-0.2, 0.06, 0.001, -0.001],
        "5": [-0.2, 0.06, 0.001, -0.001, 0.01],
        "8": [0.2, 0.03, 1e-4, 2e-4, 0.01, 0.4, 0.05, 0.02],
        "fisheye": [0.02, -0.01, 0.003, 0.0],
    }[model]
    kind = "fisheye" if model == "fisheye" else "pinhole"
    wide = {"fx": 330.0, "fy": 331.0} if model == "fisheye" else {}
    fields |= {"model": kind, "distortion": bent, **wide}
    truth = Camera.model_validate(fields)
    fit = calibrate_lens(synthetic_views(truth, 30, 0.1), SIZE, model)
    values = np.array((fit.lens.matrix[0, 0], fit.lens.matrix[1, 1], *fit.lens.matrix[:2, 2]))
    assert (np.abs(values - (truth.fx, truth.fy, truth.cx, truth.cy)) < 4.0 * fit.sigmas[:4]).all()
    assert (fit.sigmas[:4] < 1.5).all()
    found = Camera.model_validate(
        {**fields, "fx": values[0], "fy": values[1], "cx": values[2], "cy": values[3],
         "distortion": fit.lens.coefficients.tolist()}
    )  # fmt: skip
    grid = np.array([(u, v) for u in (60.0, 320.0, 580.0) for v in (60.0, 240.0, 420.0)])
    assert np.abs(truth.project(found.unproject(grid)) - grid).max() < 1.0
    assert 0.13 < fit.rms_px < 0.15
    assert fit.hold_out_px < 0.16


def test_sigmas_are_those_of_opencv() -> None:
    """Where OpenCV gives them: pinhole cameras."""
    views = synthetic_views(TRUE, 15, 0.2)
    fit = calibrate_lens(views, SIZE, "5")
    points = [view.points.astype(np.float32) for view in fit.views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in fit.views]
    # OpenCV makes matrix and coefficients itself where there are none; its annotations do not know that
    fitted = cv2.calibrateCameraExtended(points, pixels, SIZE, None, None)  # type: ignore[call-overload]
    theirs = fitted[5].ravel()[:9]
    np.testing.assert_allclose(fit.sigmas, theirs, rtol=0.02)


def test_the_derivatives_of_a_lens_are_those_of_its_pixels() -> None:
    """By the pose and by every parameter, against central differences."""
    points, turned, at = (
        np.random.default_rng(2).normal(0.0, 0.1, (5, 3)),
        np.array((0.2, -0.1, 0.3)),
        np.array((0.0, 0.1, 0.5)),
    )
    for model, bent in (("5", [-0.2, 0.06, 0.001, -0.001, 0.01]), ("fisheye", [0.02, -0.01, 0.003, 0.001])):
        start = np.array((*turned, *at, 520.0, 523.0, 320.0, 240.0, *bent))

        def pixels(x: Array, model: LensModel = model) -> Array:  # type: ignore[assignment]
            matrix = np.array(((x[6], 0.0, x[8]), (0.0, x[7], x[9]), (0.0, 0.0, 1.0)))
            return Lens(model, matrix, x[10:]).project(points, x[:3], x[3:6])[0].ravel()

        lens = Lens(model, np.array(((520.0, 0, 320.0), (0, 523.0, 240.0), (0, 0, 1.0))), np.array(bent))  # type: ignore[arg-type]
        exact = np.hstack(lens.project(points, turned, at)[1:])
        for column, change in enumerate(1e-6 * np.eye(len(start))):
            slope = (pixels(start + change) - pixels(start - change)) / 2e-6
            np.testing.assert_allclose(exact[:, column], slope, atol=2e-5 * max(1.0, np.abs(slope).max()))


def test_views_and_corners_that_do_not_fit_are_left_out_and_told() -> None:
    """One view with bent corners, one with a single wrong corner."""
    views = synthetic_views(TRUE, 18, 0.1)
    rng = np.random.default_rng(3)
    views[4] = BoardView("bent", views[4].points, views[4].pixels + rng.normal(0.0, 2.0, views[4].pixels.shape))
    wrong = views[9].pixels.copy()
    wrong[3] += 6.0
    views[9] = BoardView("corner", views[9].points, wrong)
    fit = calibrate_lens(views, SIZE)
    assert len(fit.views) == 17
    assert any(text.startswith("bent: ") for text in fit.rejected)
    assert any(text.startswith("corner: ") and "corners" in text for text in fit.rejected)
    assert abs(fit.lens.matrix[0, 0] / TRUE.fx - 1.0) < 0.003


def test_a_board_that_is_never_tilted_is_refused() -> None:
    """Its distance and the focal length cannot be told apart."""
    with pytest.raises(UasflyError, match="focal length is not determined"):
        calibrate_lens(synthetic_views(TRUE, 12, 0.1, tilt=0.002), SIZE)


def test_hints_lead_from_nothing_to_enough() -> None:
    """Each says what is missing; views that are alike are not counted twice."""
    views = synthetic_views(TRUE, 60, 0.0)
    places = [place_of(view, *SIZE) for view in views]
    assert "show the board" in coverage([], [], *SIZE).hints[0]
    one = coverage(views[:1], places[:1], *SIZE)
    assert one.hints[0].startswith("move the board to the ")
    assert not one.enough
    assert "░" not in coverage_text(one).plain
    all_of_them = coverage(views, places, *SIZE)
    assert all_of_them.enough
    assert "enough" in coverage_text(all_of_them).plain
    flat = synthetic_views(TRUE, 30, 0.0, tilt=0.02)
    hints = coverage(flat, [place_of(view, *SIZE) for view in flat], *SIZE).hints
    assert any("left or right edge away" in hint for hint in hints)
    assert any("upper or lower edge away" in hint for hint in hints)
    assert not is_new(places[0], places)
    assert len(spread([*places, *places], 200)) <= 60
    assert len(spread(places, 12)) == 12


class FakeCamera:
    """Gives pictures, each twice, and a notice."""

    def __init__(self, images: tuple[Image, ...]) -> None:
        self._images = [image for image in images for _ in range(2)]
        self._said, self._taken = False, 0

    def take(self) -> Frame | None:
        """The next one."""
        if self.ended:
            return None
        self._taken += 1
        return Frame(0.1 * self._taken, 0.1 * self._taken, self._taken, self._images[self._taken - 1])

    def take_announcements(self) -> list[Announcement]:
        """One, once."""
        said, self._said = self._said, True
        return [] if said else [(5, "camera 0: frames come")]

    @property
    def ended(self) -> bool:
        """After the last."""
        return self._taken == len(self._images)

    def close(self) -> None:
        """Nothing to do."""


@pytest.mark.parametrize("terminal", [True, False])
def test_a_live_camera_is_told_what_to_do_next(terminal: bool) -> None:
    """On a terminal and where there is none."""
    console = Console(file=io.StringIO(), force_terminal=terminal, width=80)
    views, places, images, size = collect_live(FakeCamera(charuco_views()[:6]), BOARD, 40, console, 0.0)
    assert size == SIZE
    assert 4 <= len(views) == len(places) == len(images) <= 6
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert "frames come" in told
    assert "the board" in told


def test_the_printed_board_is_the_one_that_is_looked_for(tmp_path: Path) -> None:
    """All corners of the sheet are found, half a square inside, as are those of OpenCV's own picture."""
    for text in (TEXT, "charuco:7x5:0.036:0.027:4x4_50", "charuco:6x8:0.032:0.02:5x5_100:legacy"):
        board = CharucoBoard.parse(text)
        view = board.find("sheet", cv2.GaussianBlur(texture_of(board.sheet(), 2500.0), (0, 0), 1.0).astype(np.uint8))
        assert view is not None
        assert len(view.points) == (board.columns - 1) * (board.rows - 1)
        expected = (view.points[:, :2] + 0.5 * board.square_m) * 2500.0 - 0.5
        np.testing.assert_allclose(view.pixels, expected, atol=0.3)
    run = CliRunner().invoke(app, ["calibrate", "print", "--out", str(tmp_path / "b.pdf"), "--json"])
    assert run.exit_code == 0
    assert json.loads(run.stdout)["pages"] == 1
    assert (tmp_path / "b.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("chess:7x5", "expected charuco:COLUMNS"),
        ("charuco:7x5:0.04:0.05:4x4_50", "marker < square"),
        ("charuco:7x5:0.04:0.02:4x4_51", "no dictionary"),
        ("charuco:20x20:0.04:0.02:4x4_50", "need 200 markers"),
        ("charuco:2x5:0.04:0.02:4x4_50", "3 to 60 squares"),
    ],
)
def test_a_board_that_cannot_be_is_refused(text: str, words: str) -> None:
    """With what would do."""
    with pytest.raises(UasflyError, match=words):
        CharucoBoard.parse(text)


def test_a_camera_file_keeps_all_that_a_calibration_does_not_know(tmp_path: Path) -> None:
    """Order, comments, spaces; its own comments are replaced by the next one's."""
    text = "name: mine # the left one\n" + FRESH.split("\n", 1)[1] + "latency_s: 0.05   # measured\n"
    once = with_fields(text, {"fx": 700.0, "distortion": [0.1, 0.2, 0.0, 0.0]}, "lens", ["first", "more"])
    twice = with_fields(once, {"fx": 701.0}, "lens", ["second"])
    assert twice.startswith("# lens: second\nname: mine # the left one\n")
    assert "first" not in twice
    assert "latency_s: 0.05   # measured" in twice
    assert "# ahead; straight down" in twice
    camera = write_camera(tmp_path / "camera.yaml", twice)
    assert camera.fx == 701.0
    assert camera.distortion == [0.1, 0.2, 0.0, 0.0]
    assert math.isclose(camera.latency_s, 0.05)
