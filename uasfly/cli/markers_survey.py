"""`uasfly markers survey`: where the markers of a bundle are, measured from pictures of it."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from uasfly.vision.bundle_survey.survey import SurveyResult


def survey(
    sources: list[str] = typer.Argument(help="Pictures, folders of them, or videos of the board."),
    camera: str = typer.Option(..., "--camera", help="Camera: a calibrated YAML file, or a shipped name."),
    family: str = typer.Option("36h11", "--family", help="Dictionary of the markers."),
    size: float = typer.Option(..., "--size", min=0.002, max=20.0, help="Side of the black squares in m, as measured."),
    sizes: list[str] | None = typer.Option(None, "--sizes", help="Another side of one marker: ID=SIZE, in m."),
    origin: int | None = typer.Option(None, "--origin", help="Marker at the origin; the one seen most when not given."),
    plane: bool = typer.Option(False, "--plane", help="Turn the frame: z normal to the plane through all markers."),
    views: int = typer.Option(60, "--views", min=3, max=500, help="So many spread pictures at most are adjusted."),
    step: int | None = typer.Option(None, "--step", min=1, help="Look at one frame of a video in so many (5)."),
    library: str = typer.Option("auto", "--library", help="auto, opencv, apriltag or stag."),
    out: Path = typer.Option(Path("bundle.yaml"), "--out", help="The bundle file."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table."),
) -> None:
    """Measure where the markers of a board are relative to each other, and write a bundle file.

    Take 10 to 60 sharp pictures from all sides, 1 to 2 m away, each with two markers or more, neighbours together.

    Example: [bold]uasfly markers survey walk.mp4 --camera my_camera.yaml --size 0.2 --origin 3 --out board.yaml[/]
    """
    from datetime import date
    from typing import get_args

    from uasfly.bundle import Bundle, Family
    from uasfly.camera import Camera
    from uasfly.cli.output import check_writable
    from uasfly.cli.progress import PictureProgress
    from uasfly.errors import UasflyError
    from uasfly.file_problems import did_you_mean
    from uasfly.files import find_file, load_file
    from uasfly.vision.bundle_survey.bundle_file import bundle_text, write_bundle
    from uasfly.vision.bundle_survey.survey import survey_bundle
    from uasfly.vision.bundle_survey.views import look, spread
    from uasfly.vision.detector_choice import Library, make_detector

    check_writable(out, "bundle file")
    if family not in get_args(Family):
        raise UasflyError(f"--family: no dictionary {family!r}; {did_you_mean(family, get_args(Family))}")
    if library not in get_args(Library):
        raise UasflyError(f"--library: expected one of {', '.join(get_args(Library))}, found {library!r}")
    others = _sizes(sizes or [])
    lens = load_file(find_file("camera", camera), Camera)
    detector = make_detector(family, library)  # type: ignore[arg-type]
    found, looked = [], 0
    with PictureProgress("survey") as progress:
        for _, view in look(sources, detector, lens, others, size, step):
            looked += 1
            found += [view] if view is not None else []
            progress.advance(f"{len(found)} with two markers or more")
    chosen = spread(found, lens, views)
    result = survey_bundle(chosen, lens, others, size, origin, plane=plane)
    name = re.sub(r"[^A-Za-z0-9_\-]", "_", out.stem) or "bundle"
    bundle: Bundle = result.bundle(name, family)  # type: ignore[arg-type]
    write_bundle(out, bundle_text(bundle, result, lens.name, date.today().isoformat()))
    if as_json:
        record = {"file": str(out), "pictures": looked, "with_markers": len(found), **_record(result)}
        print(json.dumps(record, indent=2))
    else:
        _print_table(result)
        print(f"{out}: {len(result.markers)} markers from {len(result.views)} of {looked} pictures")


def _sizes(texts: list[str]) -> dict[int, float]:
    from uasfly.errors import UasflyError

    sizes: dict[int, float] = {}
    for text in texts:
        number, _, size = text.partition("=")
        try:
            value = float(size)
        except ValueError:
            value = math.nan
        if not number.strip().isdecimal() or len(number) > 8 or not 0.002 <= value <= 20.0:
            raise UasflyError(f"--sizes: expected ID=SIZE with a side of 0.002 to 20 m (20=0.15), found {text!r}")
        sizes[int(number)] = value
    return sizes


def _record(result: SurveyResult) -> dict[str, Any]:
    markers = [
        {
            "id": marker.marker_id,
            "size_m": marker.size_m,
            "position_m": marker.pose.position.tolist(),
            "quaternion": marker.pose.quaternion.tolist(),
            "views": marker.views,
            "position_sigma_m": marker.position_sigma_m.tolist(),
            "rotation_sigma_rad": marker.rotation_sigma_rad.tolist(),
            "rms_px": marker.rms_px,
        }
        for marker in result.markers
    ]
    left_out = [{"id": marker, "why": why} for marker, why in result.left_out.items()]
    return {
        "origin": result.origin,
        "markers": markers,
        "left_out": left_out,
        "views": result.views,
        "rejected": result.rejected,
        "rms_px": result.rms_px,
    }


def _print_table(result: SurveyResult) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=f"Bundle at marker {result.origin}, corners {result.rms_px:.3f} px RMS")
    for title in ("id", "x y z [m]", "sigma [mm]", "turned by [deg]", "sigma [deg]", "views", "RMS [px]"):
        table.add_column(title, justify="right")
    for marker in result.markers:
        turned = 2.0 * math.degrees(math.acos(min(1.0, abs(float(marker.pose.quaternion[0])))))
        table.add_row(
            str(marker.marker_id),
            " ".join(f"{value:+.4f}" for value in marker.pose.position),
            f"{1000.0 * max(marker.position_sigma_m):.2f}",
            f"{turned:.2f}",
            f"{math.degrees(max(marker.rotation_sigma_rad)):.3f}",
            str(marker.views),
            f"{marker.rms_px:.3f}",
        )
    console = Console()
    console.print(table)
    for marker_id, why in result.left_out.items():
        console.print(Text(f"left out: marker {marker_id}: {why}", style="yellow"))
    for text in result.rejected[:10]:
        console.print(Text(f"rejected: {text}", style="yellow"))
    if len(result.rejected) > 10:
        console.print(Text(f"rejected: {len(result.rejected) - 10} more (--json has them)", style="yellow"))
