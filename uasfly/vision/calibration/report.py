"""A calibrated lens for files, scripts and eyes: fields of a camera file, comments, JSON, a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from uasfly.errors import FileError, UasflyError
from uasfly.vision.calibration.board import CharucoBoard
from uasfly.vision.calibration.coverage import COLUMNS, ROWS, Coverage
from uasfly.vision.calibration.lens import LensFit

_NAMES = {"fisheye": ("k1", "k2", "k3", "k4")}
_PINHOLE_NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_ARROW_SHARE = 0.04  # of the picture's width, for an arrow of the usual residual


def lens_fields(fit: LensFit, size: tuple[int, int]) -> dict[str, object]:
    """Fields of a camera file."""
    matrix = fit.lens.matrix
    values = {"fx": matrix[0, 0], "fy": matrix[1, 1], "cx": matrix[0, 2], "cy": matrix[1, 2]}
    return {
        "model": "fisheye" if fit.lens.model == "fisheye" else "pinhole",
        "width_px": size[0],
        "height_px": size[1],
        **{name: round(float(value), 4) for name, value in values.items()},
        "distortion": [float(f"{value:.8g}") for value in fit.lens.coefficients],
    }


def lens_comments(fit: LensFit, board: CharucoBoard, date: str) -> list[str]:
    """Comments of a camera file."""
    held = "" if math.isnan(fit.hold_out_px) else f", {fit.hold_out_px:.3f} px in views held out"
    name = f"ChArUco {board.columns}x{board.rows}, squares {board.square_m:g} m"
    sigmas = " ".join(f"{name} {value:.2g}" for name, value in _sigmas(fit).items())
    return [
        f"calibrated on {date} from {len(fit.views)} views of a {name}; RMS {fit.rms_px:.3f} px{held}",
        f"standard deviations: {sigmas}",
    ]


def lens_record(fit: LensFit, size: tuple[int, int], covered: Coverage) -> dict[str, Any]:
    """Plain data for scripts."""
    views = [
        {"name": view.name, "corners": len(view.points), "rms_px": _rms_of(part)}
        for view, part in zip(fit.views, fit.residuals, strict=True)
    ]
    return {
        **lens_fields(fit, size),
        "sigmas": _sigmas(fit),
        "rms_px": fit.rms_px,
        "hold_out_px": None if math.isnan(fit.hold_out_px) else fit.hold_out_px,
        "views": views,
        "rejected": fit.rejected,
        "coverage": {
            "regions": covered.regions.astype(int).tolist(),
            "share": covered.covered,
            "tilts_deg": list(covered.tilts_deg),
            "sizes": covered.sizes,
            "missing": list(covered.hints),
        },
    }


def _sigmas(fit: LensFit) -> dict[str, float]:
    names = ("fx", "fy", "cx", "cy", *_NAMES.get(fit.lens.model, _PINHOLE_NAMES))
    return {name: float(value) for name, value in zip(names, fit.sigmas, strict=False)}


def _rms_of(residuals: Any) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean()))


def can_draw() -> bool:
    """Whether matplotlib is installed."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return False
    return True


def write_picture(path: Path, fit: LensFit, size: tuple[int, int], covered: Coverage) -> None:
    """Residuals as arrows where they are in the picture, coverage behind them, each view's RMS below (PNG).

    Raises:
        UasflyError: matplotlib is not installed.
        FileError: the file cannot be written.
    """
    if not can_draw():
        raise UasflyError("--picture: drawing needs matplotlib; install it (pip install 'uasfly[vision]')")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width, height = size
    figure = Figure(figsize=(9.0, 9.0 * height / width + 2.2), layout="constrained")
    axes, below = figure.subplots(2, 1, height_ratios=(9.0 * height / width, 1.6))
    axes.imshow(covered.regions, extent=(-0.5, width - 0.5, height - 0.5, -0.5), cmap="Greens", alpha=0.35, vmin=0)
    pixels = np.concatenate([view.pixels for view in fit.views])
    residuals = np.concatenate(fit.residuals)
    factor = _ARROW_SHARE * width / max(fit.rms_px, 1e-6)
    length = np.linalg.norm(residuals, axis=1)
    arrows = axes.quiver(
        *pixels.T,
        *(factor * residuals).T,
        length,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        cmap="viridis",
        width=0.0015,
    )
    figure.colorbar(arrows, ax=axes, label="pixel minus projection [px]")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")
    axes.set_xticks(np.linspace(0, width, COLUMNS + 1))
    axes.set_yticks(np.linspace(0, height, ROWS + 1))
    axes.grid(color="0.8", linewidth=0.5)
    axes.set_title(f"{len(pixels)} corners, {fit.rms_px:.3f} px RMS; arrows {factor:.0f} times as long", fontsize=10)
    below.bar(range(len(fit.views)), [_rms_of(part) for part in fit.residuals], color="0.5")
    below.axhline(fit.rms_px, color="black", linewidth=0.8)
    below.set_xlabel("view")
    below.set_ylabel("RMS [px]")
    try:
        FigureCanvasAgg(figure).print_png(path)  # type: ignore[no-untyped-call,unused-ignore]
    except OSError as error:
        raise FileError(str(path), [f"the picture cannot be written: {error.strerror or error}"]) from None
