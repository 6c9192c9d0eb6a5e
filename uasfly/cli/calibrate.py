"""`uasfly calibrate`: a camera's lens from pictures of a board; the board for printing; the mounting from a log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from uasfly.cli.calibrate_mounting import mounting

if TYPE_CHECKING:
    from rich.console import Console

    from uasfly.messages import Array
    from uasfly.vision.calibration.board import BoardView, CharucoBoard
    from uasfly.vision.calibration.coverage import Coverage
    from uasfly.vision.calibration.lens import LensFit
    from uasfly.vision.detectors import Image

_BOARD = "Board: charuco:COLUMNSxROWS:SQUARE_M:MARKER_M:DICTIONARY."
_DEFAULT_BOARD = "charuco:5x7:0.03:0.022:4x4_50"
_STREAMS = ("://", "/dev/")


class _LensByDefault(TyperGroup):
    """`uasfly calibrate SOURCE...` is `uasfly calibrate lens SOURCE...`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the name of the default command in front where none is given."""
        if args and args[0] not in {*self.commands, "--help"}:
            args = ["lens", *args]
        return list(super().parse_args(ctx, args))


calibrate = typer.Typer(
    cls=_LensByDefault,
    no_args_is_help=True,
    help="Calibrate a camera: its lens from pictures of a board (calibrate SOURCE...), its mounting from a log.",
)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    calibrate.command(name="lens")(lens)
    calibrate.command(name="mounting")(mounting)
    calibrate.command(name="print")(print_board)
    app.add_typer(calibrate, name="calibrate")


def lens(
    sources: list[str] = typer.Argument(help="Pictures, folders, videos; or one camera: 0, /dev/video0, rtsp://..."),
    board: str = typer.Option(_DEFAULT_BOARD, "--board", help=_BOARD),
    model: str = typer.Option("5", "--model", help="Coefficients: 4, 5 or 8 of a pinhole camera, or fisheye."),
    camera: str | None = typer.Option(
        None, "--camera", help="Camera file that all but the lens is taken from; --out where that is there already."
    ),
    views: int = typer.Option(40, "--views", min=8, max=500, help="So many spread views at most."),
    step: int | None = typer.Option(None, "--step", min=1, help="Look at one frame of a video in so many (5)."),
    picture: Path | None = typer.Option(None, "--picture", help="Residuals as a PNG; beside --out when not given."),
    out: Path = typer.Option(Path("camera.yaml"), "--out", help="The camera file."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table."),
) -> None:
    """Calibrate a lens from pictures of a ChArUco board, and write a camera file.

    With a camera it tells what to do next until there is enough; Ctrl-C calibrates with what there is.

    Example: [bold]uasfly calibrate 0 --board charuco:5x7:0.03:0.022:4x4_50 --out my_camera.yaml[/]
    """
    from datetime import date
    from typing import get_args

    from rich.console import Console

    from uasfly.cli.output import check_writable
    from uasfly.errors import UasflyError
    from uasfly.files import find_file
    from uasfly.vision.calibration import report
    from uasfly.vision.calibration.board import CharucoBoard
    from uasfly.vision.calibration.camera_file import camera_text, with_fields, write_camera
    from uasfly.vision.calibration.coverage import coverage
    from uasfly.vision.calibration.lens import LensModel
    from uasfly.vision.calibration.refine import calibrate_exactly

    check_writable(out, "camera file")
    check_writable(picture, "picture")
    if model not in get_args(LensModel):
        raise UasflyError(f"--model: expected one of {', '.join(get_args(LensModel))}, found {model!r}")
    if picture is not None and not report.can_draw():
        raise UasflyError("--picture: drawing needs matplotlib; install it (pip install 'uasfly[vision]')")
    shown = CharucoBoard.parse(board)
    base = find_file("camera", camera) if camera is not None else out if out.exists() else None
    text = camera_text(base)
    found, places, images, size, looked = _views(sources, shown, views, step, Console(stderr=True))
    covered = coverage(found, places, *size)
    try:
        fit = calibrate_exactly(shown, found, images, size, model)  # type: ignore[arg-type]
    except UasflyError as error:
        raise UasflyError(f"{', '.join(sources)}: {error} ({looked} pictures were looked at)") from None
    fields = report.lens_fields(fit, size)
    comments = report.lens_comments(fit, shown, date.today().isoformat())
    write_camera(out, with_fields(text, fields, "lens", comments))
    drawn = picture if picture is not None else out.with_suffix(".png") if report.can_draw() else None
    if drawn is not None:
        report.write_picture(drawn, fit, size, covered)
    if as_json:
        record = {"file": str(out), "picture": None if drawn is None else str(drawn), "looked_at": looked}
        print(json.dumps({**record, **report.lens_record(fit, size, covered)}, indent=2))
        return
    _print_result(fit, report.lens_record(fit, size, covered), covered)
    print(f"{out}: written" + ("" if drawn is None else f"; look at {drawn}"))


def print_board(
    board: str = typer.Option(_DEFAULT_BOARD, "--board", help=_BOARD),
    paper: str = typer.Option("a4", "--paper", help="a4, a3 or letter."),
    out: Path = typer.Option(Path("board.pdf"), "--out", help="The PDF."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON."),
) -> None:
    """Write a ChArUco board to scale into a PDF; glue it on something flat, measure it, and give that size.

    Example: [bold]uasfly calibrate print --board charuco:9x6:0.04:0.03:4x4_50 --paper a3 --out board.pdf[/]
    """
    from uasfly.cli.output import check_writable
    from uasfly.errors import FileError, UasflyError
    from uasfly.vision import sheets
    from uasfly.vision.calibration.board import CharucoBoard
    from uasfly.vision.printing import write_pdf

    check_writable(out, "PDF")
    if paper not in sheets.PAPERS_MM:
        raise UasflyError(f"--paper: expected one of {', '.join(sheets.PAPERS_MM)}, found {paper!r}")
    sheet = CharucoBoard.parse(board).sheet()
    pages = sheets.pages_of([sheet], paper)  # type: ignore[arg-type]
    try:
        write_pdf(out, pages, paper)  # type: ignore[arg-type]
    except OSError as error:
        raise FileError(str(out), [f"the PDF cannot be written: {error.strerror}"]) from None
    if as_json:
        print(json.dumps({"file": str(out), "paper": paper, "sheet": sheet.title, "pages": len(pages)}, indent=2))
        return
    tiles = "" if len(pages) == 1 else "; in pieces a board is never flat: take a larger paper or smaller squares"
    print(f"{out}: {sheet.title}, {len(pages)} page{'s' if len(pages) > 1 else ''} of {paper}{tiles}")


def _views(
    sources: list[str], board: CharucoBoard, most: int, step: int | None, console: Console
) -> tuple[list[BoardView], list[Array], dict[str, Image], tuple[int, int], int]:
    """Spread views of the board, their places and pictures, the pictures' size, how many pictures were looked at."""
    from uasfly.cli.coverage_view import collect_live
    from uasfly.errors import FileError, UasflyError
    from uasfly.vision.calibration.coverage import place_of
    from uasfly.vision.detectors import grey_picture
    from uasfly.vision.pictures import pictures, step_of
    from uasfly.vision.sources import open_source

    live = [source for source in sources if source.isdecimal() or any(sign in source for sign in _STREAMS)]
    if live:
        if len(sources) > 1:
            raise UasflyError(f"expected one camera, or pictures and videos, found {len(sources)} sources")
        camera = open_source(sources[0])
        try:
            return *collect_live(camera, board, most, console), camera.counts[0]
        finally:
            camera.close()
    from uasfly.cli.progress import PictureProgress

    found: list[BoardView] = []
    places: list[Array] = []
    images: dict[str, Image] = {}
    size, looked = (0, 0), 0
    with PictureProgress("calibrate") as progress:
        for source in sources:
            every = step_of(source, step)
            for number, (name, image) in enumerate(pictures(source)):
                if number % every:
                    continue
                here = (image.shape[1], image.shape[0])
                if looked and here != size:
                    problem = f"expected {size[0]} x {size[1]} px as before, found {here[0]} x {here[1]}"
                    raise FileError(name, [f"{problem}; calibrate one camera in one mode"])
                size, looked = here, looked + 1
                view = board.find(name, image)
                if view is not None:
                    found.append(view)
                    places.append(place_of(view, *size))
                    images[name] = grey_picture(image)
                if len(found) > 3 * most:  # what a long video would fill the memory with
                    found, places, images = _spread(found, places, images, 2 * most)
                progress.advance(f"the board is in {len(images)}")
    return *_spread(found, places, images, most), size, looked


def _spread(
    views: list[BoardView], places: list[Array], images: dict[str, Image], most: int
) -> tuple[list[BoardView], list[Array], dict[str, Image]]:
    from uasfly.vision.calibration.coverage import spread

    chosen = spread(places, most)
    kept = [views[index] for index in chosen]
    return kept, [places[index] for index in chosen], {view.name: images[view.name] for view in kept}


def _print_result(fit: LensFit, record: dict[str, Any], covered: Coverage) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from uasfly.cli.coverage_view import coverage_text

    table = Table(title=f"Lens from {len(fit.views)} views, {fit.rms_px:.3f} px RMS")
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("sigma", justify="right")
    names = list(record["sigmas"])
    values = [*(record[name] for name in names[:4]), *record["distortion"]]
    for name, value in zip(names, values, strict=True):
        table.add_row(name, f"{value:.5g}" if len(name) == 2 and name[0] in "kp" else f"{value:.2f}",
                      f"{record['sigmas'][name]:.2g}")  # fmt: skip
    console = Console()
    console.print(table)
    console.print(coverage_text(covered))
    worst = sorted(record["views"], key=lambda view: -view["rms_px"])[:3]
    console.print(Text("worst views: " + ", ".join(f"{Path(v['name']).name} {v['rms_px']:.3f} px" for v in worst)))
    held = record["hold_out_px"]
    told = "too few views for it" if held is None else f"{held:.3f} px RMS"
    console.print(Text(f"views that the lens was not fitted to: {told}"))
    for text in fit.rejected:
        console.print(Text(f"left out: {text}", style="yellow"))
