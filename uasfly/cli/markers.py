"""`uasfly markers print` and `uasfly markers detect`: markers on paper, and markers in pictures.

`uasfly markers survey` is in `markers_survey`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from uasfly.cli.markers_survey import survey

if TYPE_CHECKING:
    from uasfly.bundle import Bundle

markers = typer.Typer(no_args_is_help=True, help="Print fiducial markers, find them in pictures, survey boards.")


def register(app: typer.Typer) -> None:
    """Add the commands."""
    markers.command(name="print")(print_markers)
    markers.command(name="detect")(detect)
    markers.command(name="survey")(survey)
    app.add_typer(markers, name="markers")


def print_markers(
    bundle: str | None = typer.Option(None, "--bundle", help="Bundle: a shipped name (four_36h11) or a YAML file."),
    family: str = typer.Option("36h11", "--family", help="Dictionary of single markers, where no bundle is given."),
    ids: str = typer.Option("0", "--ids", help="Ids of single markers: 0-3,7."),
    size_cm: float = typer.Option(16.0, "--size-cm", min=0.5, max=500.0, help="Side of the black square."),
    whole: bool = typer.Option(
        False, "--whole", help="The whole bundle on one sheet, tiled over pages, not a marker each."
    ),
    paper: str = typer.Option("a4", "--paper", help="a4, a3 or letter."),
    out: Path = typer.Option(Path("markers.pdf"), "--out", help="The PDF."),
    as_json: bool = typer.Option(False, "--json", help="Print a JSON list of the pages."),
) -> None:
    """Write markers to scale into a PDF, tiled with cut marks where they are larger than the paper.

    Measure the ruler of 100 mm on each page before you trust a print.

    Example: [bold]uasfly markers print --bundle four_36h11 --paper a3 --out board.pdf[/]
    """
    from uasfly.cli.output import check_writable
    from uasfly.errors import FileError, UasflyError
    from uasfly.vision import sheets
    from uasfly.vision.printing import write_pdf
    from uasfly.vision.stag_ros import find_bundle

    check_writable(out, "PDF")
    if paper not in sheets.PAPERS_MM:
        raise UasflyError(f"--paper: expected one of {', '.join(sheets.PAPERS_MM)}, found {paper!r}")
    printed = find_bundle(bundle) if bundle is not None else _single_markers(family, _ids(ids), size_cm / 100.0)
    pieces = [sheets.bundle_sheet(printed)] if whole else sheets.marker_sheets(printed)
    pages = sheets.pages_of(pieces, paper)  # type: ignore[arg-type]
    try:
        write_pdf(out, pages, paper)  # type: ignore[arg-type]
    except OSError as error:
        raise FileError(str(out), [f"the PDF cannot be written: {error.strerror}"]) from None
    rows = [
        {"page": number, "sheet": page.sheet.title, "row": page.row + 1, "column": page.column + 1}
        for number, page in enumerate(pages, 1)
    ]
    if as_json:
        print(json.dumps({"file": str(out), "paper": paper, "pages": rows}, indent=2))
        return
    for piece in pieces:
        tiles = [page for page in pages if page.sheet is piece]
        print(f"{piece.title}: {len(tiles)} page{'s' if len(tiles) > 1 else ''}")
    print(f"{out}: {len(pages)} pages of {paper}; print at 100 % and measure the ruler")


def detect(
    sources: list[str] = typer.Argument(help="Pictures, folders, videos, numbers of cameras, or URLs of streams."),
    bundle: str | None = typer.Option(None, "--bundle", help="Bundle whose pose is wanted: a shipped name or a file."),
    family: str = typer.Option("36h11", "--family", help="Dictionary, where no bundle is given."),
    dictionary: Path | None = typer.Option(
        None, "--dictionary", help="A dictionary file of OpenCV instead of a family."
    ),
    camera: str | None = typer.Option(None, "--camera", help="Camera: a shipped name (wide_720p) or a YAML file."),
    library: str = typer.Option("auto", "--library", help="auto, opencv, apriltag or stag."),
    frames: int | None = typer.Option(None, "--frames", min=1, help="So many pictures of each source at most."),
    out: Path | None = typer.Option(None, "--out", help="Write pictures with the markers drawn in to this folder."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table."),
) -> None:
    """Find markers in pictures: ids, pose with sigmas where camera and bundle are given, times.

    Example: [bold]uasfly markers detect photos/ --bundle four_36h11 --camera my_camera.yaml --out found[/]
    """
    from uasfly.vision.survey import Survey, make_survey

    looking: Survey = make_survey(bundle, family, dictionary, camera, library, out)
    records: list[dict[str, Any]] = [record for source in sources for record in looking.look_at(source, frames)]
    summary = looking.summary(records)
    if as_json:
        print(json.dumps({"pictures": records, "summary": summary}, indent=2))
    else:
        _print_table(records, summary)


def _print_table(records: list[dict[str, Any]], summary: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table()
    for title in ("picture", "ids", "x y z [m, camera]", "sigma [mm]", "left out", "ms"):
        table.add_column(title)
    for record in records:
        pose = record["pose"]
        at = " ".join(f"{value:+.3f}" for value in pose["position_in_camera_m"]) if pose else "-"
        sigma = " ".join(f"{1000 * value:.1f}" for value in pose["position_sigma_m"]) if pose else "-"
        left_out = "; ".join(f"{entry['id']}: {entry['reason']}" for entry in record["left_out"])
        ids = " ".join(str(marker["id"]) for marker in record["markers"]) or "none"
        doubt = " (may be tilted the other way)" if pose and pose["ambiguous"] else ""
        cells = (Path(record["picture"]).name, ids, at + doubt, sigma, left_out, f"{record['ms']:.0f}")
        table.add_row(*(Text(cell) for cell in cells))
    Console().print(table)
    print(
        f"{summary['pictures']} pictures, {summary['with_markers']} with markers, {summary['with_pose']} with a pose; "
        f"median {summary['ms_median']:.1f} ms, {summary['rate_hz']:.1f} pictures a second"
    )


def _ids(text: str) -> list[int]:
    from uasfly.errors import UasflyError

    numbers: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()) or len(first + last) > 12:
            raise UasflyError(f"--ids: expected numbers and ranges (0-3,7), found {text!r}")
        span = range(int(first), int(last if dash else first) + 1)
        if not span or len(span) > 1000:
            raise UasflyError(f"--ids: expected up to 1000 ids in growing order (0-3,7), found {text!r}")
        numbers += span
    return list(dict.fromkeys(numbers))


def _single_markers(family: str, ids: list[int], size_m: float) -> Bundle:
    from pydantic import ValidationError

    from uasfly.bundle import Bundle
    from uasfly.errors import FileError
    from uasfly.file_problems import describe_problems

    fields = {"name": "markers", "family": family, "markers": [{"id": number, "size_m": size_m} for number in ids]}
    try:
        return Bundle.model_validate(fields)
    except ValidationError as error:
        raise FileError("--family, --ids, --size-cm", describe_problems(error, Bundle, lambda _: "")) from None
