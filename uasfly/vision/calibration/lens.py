"""Intrinsics and distortion from views of a board, with sigmas, outliers out, and a check on views held out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.vision.calibration.board import LEAST_CORNERS, BoardView

LensModel = Literal["4", "5", "8", "fisheye"]
LEAST_VIEWS = 8
LEAST_FOR_HOLD_OUT = 2 * LEAST_VIEWS
_ROUNDS = 6
_VIEW_OUTLIER, _CORNER_OUTLIER = 3.0, 5.0  # times the usual
_LEAST_OUTLIER_PX = 0.3
_FISHEYE_STARTS = (1.0 / math.pi, 0.45, 0.6, 0.85)  # focal length in picture widths
_FOCAL_SHARE = 0.02  # a focal length whose sigma is larger is not determined


@dataclass(frozen=True, slots=True)
class Lens:
    """Intrinsics and distortion: OpenCV's matrix (3, 3) and coefficients."""

    model: LensModel
    matrix: Array
    coefficients: Array

    def project(self, points: Array, turned: Array, at: Array) -> tuple[Array, Array, Array]:
        """Pixels (n, 2) of points of the board; derivatives by the pose (2n, 6) and by fx, fy, cx, cy ... (2n, k)."""
        import cv2

        if self.model == "fisheye":
            pixels, slope = cv2.fisheye.projectPoints(
                points.reshape(-1, 1, 3), turned.reshape(3, 1), at.reshape(3, 1), self.matrix, self.coefficients
            )
            by_pose, by_lens = slice(8, 14), slice(0, 8)
        else:
            pixels, slope = cv2.projectPoints(points, turned, at, self.matrix, self.coefficients)
            by_pose, by_lens = slice(0, 6), slice(6, 10 + len(self.coefficients))
        derivatives = np.asarray(slope, dtype=np.float64)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2), derivatives[:, by_pose], derivatives[:, by_lens]


@dataclass(frozen=True, slots=True)
class LensFit:
    """A calibrated lens.

    Attributes:
        lens: the result.
        sigmas: (4 + k,) standard deviations of fx, fy, cx, cy and the coefficients.
        rms_px: of all corners, both axes together.
        views: that were used; residuals: of each (n, 2) px, pixel minus projection.
        rejected: views and corners that did not fit, for people.
        poses: rotation vector and position [m] of the board in each view, in camera axes.
        hold_out_px: RMS of views that the lens was not fitted to; NaN where there were too few.
    """

    lens: Lens
    sigmas: Array
    rms_px: float
    views: list[BoardView]
    residuals: list[Array]
    poses: list[tuple[Array, Array]]
    rejected: list[str] = field(default_factory=list)
    hold_out_px: float = math.nan


def calibrate_lens(views: list[BoardView], size: tuple[int, int], model: LensModel = "5") -> LensFit:
    """Lens from views of the board.

    Args:
        views: spread over the picture, tilts and distances.
        size: width and height of the picture [px].
        model: number of coefficients of a pinhole camera, or fisheye.

    Raises:
        UasflyError: too few views, or views that do not determine the lens.
    """
    rejected: list[str] = []
    for _ in range(_ROUNDS):
        _check_count(views, rejected)
        lens, poses = _fit(views, size, model)
        residuals = _residuals(lens, views, poses)
        kept, problems = _without_outliers(views, residuals)
        if not problems:
            break
        rejected += problems
        views = kept
    else:
        _check_count(views, rejected)
        lens, poses = _fit(views, size, model)
        residuals = _residuals(lens, views, poses)
    sigmas = lens_sigmas(lens, views, poses, residuals)
    focal = float(np.max(sigmas[:2] / (lens.matrix[0, 0], lens.matrix[1, 1])))
    if not focal < _FOCAL_SHARE:
        raise UasflyError(
            f"the focal length is not determined by these pictures (sigma {100.0 * focal:.1f} % of it, expected less "
            f"than {100.0 * _FOCAL_SHARE:g} %); add pictures with the board tilted by 20 to 40 degrees each way"
        )
    return LensFit(lens, sigmas, _rms(residuals), views, residuals, poses, rejected, _hold_out(views, size, model))


def _check_count(views: list[BoardView], rejected: list[str]) -> None:
    if len(views) < LEAST_VIEWS:
        after = f" once {len(rejected)} that did not fit were left out" if rejected else ""
        raise UasflyError(
            f"too few views: expected {LEAST_VIEWS} or more different pictures in which {LEAST_CORNERS} corners of the "
            f"board are seen, found {len(views)}{after}; take 15 to 40, over the whole picture, tilted each way"
        )


def _fit(views: list[BoardView], size: tuple[int, int], model: LensModel) -> tuple[Lens, list[tuple[Array, Array]]]:
    import cv2

    points = [view.points.astype(np.float32).reshape(-1, 1, 3) for view in views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    try:
        if model == "fisheye":
            _, matrix, coefficients, turned, at = _fit_fisheye(views, size, criteria)
        else:
            flags = {"4": cv2.CALIB_FIX_K3, "5": 0, "8": cv2.CALIB_RATIONAL_MODEL}[model]
            _, matrix, coefficients, turned, at = cv2.calibrateCamera(
                points, pixels, size, None, None, flags=flags, criteria=criteria
            )
    except cv2.error as error:
        reason = str(error).strip().splitlines()[-1]
        raise UasflyError(
            f"these views do not determine the lens: {reason}; add other tilts and places, or try --model 4"
        ) from None
    count = 4 if model == "fisheye" else int(model)
    lens = Lens(model, np.asarray(matrix, dtype=float), np.asarray(coefficients, dtype=float).ravel()[:count])
    return lens, [
        (np.asarray(r, dtype=float).ravel(), np.asarray(t, dtype=float).ravel())
        for r, t in zip(turned, at, strict=True)
    ]


def _fit_fisheye(views: list[BoardView], size: tuple[int, int], criteria: tuple[int, int, float]) -> Any:
    """What OpenCV's fisheye calibration gives; it stays where it began from many starts, so the best of some is taken.

    Raises:
        cv2.error: from every start.
    """
    import cv2

    flags = _fisheye_flags("CALIB_RECOMPUTE_EXTRINSIC", "CALIB_FIX_SKEW", "CALIB_USE_INTRINSIC_GUESS")
    points = [view.points.reshape(1, -1, 3) for view in views]  # it takes rows, not columns
    pixels = [view.pixels.reshape(1, -1, 2) for view in views]
    results, problem = [], None
    for share in _FISHEYE_STARTS:
        focal = share * max(size)
        start = np.array(((focal, 0.0, 0.5 * size[0]), (0.0, focal, 0.5 * size[1]), (0.0, 0.0, 1.0)))
        try:
            results.append(
                cv2.fisheye.calibrate(points, pixels, size, start, np.zeros((4, 1)), flags=flags, criteria=criteria)
            )
        except cv2.error as error:
            problem = error
    if not results and problem is not None:
        raise problem
    return min(results, key=lambda result: result[0] if math.isfinite(result[0]) else math.inf)


def _fisheye_flags(*names: str) -> int:
    """OpenCV's flags: those of its fisheye module before version 5, of the module itself since."""
    import cv2

    return sum(int(getattr(cv2.fisheye, name, None) or getattr(cv2, name)) for name in names)


def _residuals(lens: Lens, views: list[BoardView], poses: list[tuple[Array, Array]]) -> list[Array]:
    return [v.pixels - lens.project(v.points, *pose)[0] for v, pose in zip(views, poses, strict=True)]


def _rms(residuals: list[Array]) -> float:
    return float(np.sqrt((np.concatenate(residuals) ** 2).sum(axis=1).mean()))


def _without_outliers(views: list[BoardView], residuals: list[Array]) -> tuple[list[BoardView], list[str]]:
    """The views without those, and without single corners, that do not fit; and what was taken out."""
    of_view = np.array([_rms([part]) for part in residuals])
    limit = max(_VIEW_OUTLIER * float(np.median(of_view)), _LEAST_OUTLIER_PX)
    length = [np.linalg.norm(part, axis=1) for part in residuals]
    corner_limit = max(_CORNER_OUTLIER * float(np.median(np.concatenate(length))), 2.0 * _LEAST_OUTLIER_PX)
    kept, problems = [], []
    for view, error, lengths in zip(views, of_view, length, strict=True):
        bad = lengths > corner_limit
        rest = float(np.sqrt((lengths[~bad] ** 2).mean())) if (~bad).any() else math.inf
        if rest > limit or (~bad).sum() < LEAST_CORNERS:
            problems.append(f"{view.name}: {error:.2f} px RMS, the usual view has {np.median(of_view):.2f}")
        elif bad.any():
            problems.append(f"{view.name}: {bad.sum()} corners, up to {lengths.max():.2f} px off")
            kept.append(view.without(bad))
        else:
            kept.append(view)
    return kept, problems


def lens_sigmas(lens: Lens, views: list[BoardView], poses: list[tuple[Array, Array]], residuals: list[Array]) -> Array:
    """(4 + k,) standard deviations of fx, fy, cx, cy and the coefficients, poses taken out view by view (Schur)."""
    count = 4 + len(lens.coefficients)
    normal, corners = np.zeros((count, count)), 0
    for view, pose in zip(views, poses, strict=True):
        _, by_pose, by_lens = lens.project(view.points, *pose)
        across = by_pose.T @ by_lens
        normal += by_lens.T @ by_lens - across.T @ np.linalg.solve(by_pose.T @ by_pose, across)
        corners += len(view.points)
    freedom = max(2 * corners - 6 * len(views) - count, 1)
    variance = float((np.concatenate(residuals) ** 2).sum()) / freedom
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))  # coefficients and pixels differ by many powers of ten
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale)
    return np.asarray(np.sqrt(variance * np.maximum(np.diag(inverse), 0.0)), dtype=float)


def _hold_out(views: list[BoardView], size: tuple[int, int], model: LensModel) -> float:
    """RMS [px] of each half of the views through a lens that was fitted to the other half; their poses are free."""
    if len(views) < LEAST_FOR_HOLD_OUT:
        return math.nan
    residuals = []
    for fitted, held in ((views[::2], views[1::2]), (views[1::2], views[::2])):
        try:
            lens, _ = _fit(fitted, size, model)
        except UasflyError:
            return math.nan
        residuals += [_posed_residuals(lens, view) for view in held]
    return _rms(residuals)


def _posed_residuals(lens: Lens, view: BoardView) -> Array:
    import cv2

    if lens.model == "fisheye":
        plane = cv2.fisheye.undistortPoints(view.pixels.reshape(-1, 1, 2), lens.matrix, lens.coefficients)
        sane = (np.abs(plane.reshape(-1, 2)) < 10.0).all(axis=1)  # OpenCV's iteration gives -1e6 where it fails
        if sane.sum() < 4:
            return np.empty((0, 2))
        _, turned, at = cv2.solvePnP(view.points[sane], plane[sane], np.eye(3), None)
    else:
        _, turned, at = cv2.solvePnP(view.points, view.pixels, lens.matrix, lens.coefficients)
    pose: Array = np.concatenate((turned.ravel(), at.ravel())).astype(np.float64)
    for _ in range(10):
        pixels, by_pose, _ = lens.project(view.points, pose[:3], pose[3:])
        step, *_ = np.linalg.lstsq(by_pose, (view.pixels - pixels).ravel(), rcond=None)
        pose = pose + np.asarray(step, dtype=np.float64)
    left: Array = view.pixels - lens.project(view.points, pose[:3], pose[3:])[0]
    return left
