"""`uasfly calibrate mounting`: how a camera is mounted on the vehicle, from the log of a flight."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from uasfly.cli import options
from uasfly.cli.fly import SystemId

if TYPE_CHECKING:
    from uasfly.camera import Camera
    from uasfly.drivers.sight import SightOptions
    from uasfly.vision.calibration.mounting.fit import Belief, MountingFit

EXIT_UNKNOWN = 1
_AXES = ("x", "y", "z")


def mounting(
    log: Path = typer.Argument(
        help="Flight log (--log of a flight with --camera) with a bundle in sight; with --connect it is recorded first."
    ),
    camera: str | None = typer.Option(
        None, "--camera", help="Camera file that all but the mounting is taken from; the log's camera when not given."
    ),
    out: Path | None = typer.Option(None, "--out", help="Write the camera file here; nothing is written without it."),
    overwrite: bool = typer.Option(False, "--overwrite", help="--out may be there already, also be --camera itself."),
    prior: bool = typer.Option(
        False, "--prior", help="The camera file's mounting and its sigmas count too, as a measurement."
    ),
    latency: bool = typer.Option(False, "--latency", help="Write the latency too, with the time offset taken in."),
    heading_sigma: float = typer.Option(
        3.0, "--heading-sigma", min=0.01, max=90.0, help="Constant error of the vehicle's heading (compass), in deg."
    ),
    picture: Path | None = typer.Option(None, "--picture", help="Residuals as a PNG; beside --out when not given."),
    connect: str | None = typer.Option(
        None, "--connect", help="Record the log first, from a vehicle that is carried by hand, disarmed: its URL."
    ),
    bundles: options.Bundles = None,
    camera_source: options.CameraSource = None,
    duration: float = typer.Option(60.0, "--duration", min=1.0, max=3600.0, help="Of that recording, in s."),
    system_id: SystemId = None,
    as_json: bool = typer.Option(False, "--json", help="Print JSON instead of a table."),
) -> None:
    """Calibrate rotation and place of a camera on the vehicle from a log, and write them into a camera file.

    Needs turns about the vertical, tilts to all sides and some way, with a bundle at rest in sight; what is missing is
    told. Exit code 1: the mounting is not known well enough, nothing was written. With --connect nothing flies: carry
    the vehicle over the bundle, Ctrl-C ends the recording.

    Example: [bold]uasfly calibrate mounting flight.mcap --camera my_camera.yaml --out my_camera.yaml --overwrite[/]
    """
    from datetime import date

    from uasfly.camera import Camera
    from uasfly.drivers.mounting_log import read_mounting_log
    from uasfly.drivers.sight import SightOptions
    from uasfly.errors import FileError, UasflyError
    from uasfly.files import find_file, load_file
    from uasfly.vision.calibration.camera_file import camera_text, text_of, with_fields, write_camera
    from uasfly.vision.calibration.mounting import report
    from uasfly.vision.calibration.mounting.fit import Belief
    from uasfly.vision.calibration.mounting.missing import missing
    from uasfly.vision.calibration.mounting.shutter import fit_through_shutter
    from uasfly.vision.calibration.report import can_draw

    _check_outputs(out, picture, overwrite=overwrite)
    base = None if camera is None else find_file("camera", camera)
    if connect is not None:
        _record(log, connect, SightOptions(camera, tuple(bundles or ()), camera_source), duration, system_id)
    elif bundles or camera_source:
        raise UasflyError("--bundle and --camera-source belong to --connect: a log knows its bundles")
    recorded = read_mounting_log(log)
    stated = recorded.camera if base is None else load_file(base, Camera)
    placement = stated.transform_camera_to_body
    believed = Belief(placement.rotation, placement.position, heading_sigma_rad=math.radians(heading_sigma))
    if prior:
        believed = _trusting(believed, stated)
    try:
        fit = fit_through_shutter(recorded.motion, recorded.sightings, believed, recorded.camera, recorded.bundles)
    except UasflyError as error:
        raise FileError(str(log), [str(error)]) from None
    lacks = missing(fit)
    written = None
    if out is not None and lacks is None:
        text = text_of(recorded.camera) if base is None else camera_text(base)
        fields = report.mounting_fields(fit, report.latency(fit, recorded.camera) if latency else None)
        comments = report.mounting_comments(fit, log.name, date.today().isoformat())
        write_camera(out, with_fields(text, fields, "mounting", comments))
        written = out
    drawn = picture if picture is not None else out.with_suffix(".png") if out is not None and can_draw() else None
    if drawn is not None:
        report.write_mounting_picture(drawn, fit)
    record = {
        "file": None if written is None else str(written),
        "picture": None if drawn is None else str(drawn),
        "log": str(log),
        "log_complete": recorded.complete,
        **report.mounting_record(fit, stated, lacks),
    }
    if as_json:
        print(json.dumps(record, indent=2))
    else:
        _print_table(fit, stated, record)
    if lacks is not None:
        raise typer.Exit(EXIT_UNKNOWN)


def _check_outputs(out: Path | None, picture: Path | None, *, overwrite: bool) -> None:
    from uasfly.cli.output import check_writable
    from uasfly.errors import FileError, UasflyError
    from uasfly.vision.calibration.report import can_draw

    check_writable(out, "camera file")
    check_writable(picture, "picture")
    if out is not None and out.exists() and not overwrite:
        raise FileError(
            str(out), ["this file is there already; add --overwrite to change its mounting, or name another"]
        )
    if picture is not None and not can_draw():
        raise UasflyError("--picture: drawing needs matplotlib; install it (pip install 'uasfly[vision]')")


def _trusting(belief: Belief, camera: Camera) -> Belief:
    from uasfly.errors import UasflyError

    if not (camera.mounting_sigma_deg > 0.0 and camera.mounting_sigma_m > 0.0):
        raise UasflyError(
            f"--prior: expected mounting_sigma_m and mounting_sigma_deg above 0 in the camera file {camera.name}, "
            f"found {camera.mounting_sigma_m:g} and {camera.mounting_sigma_deg:g}: say how well it was measured"
        )
    return belief.trusting(math.radians(camera.mounting_sigma_deg), camera.mounting_sigma_m)


def _record(log: Path, url: str, sight: SightOptions, duration_s: float, system_id: int | None) -> None:
    from uasfly.cli.output import check_writable
    from uasfly.cli.progress import RecordingProgress
    from uasfly.drivers.hand_held import record_hand_held
    from uasfly.drivers.sight import load_sight
    from uasfly.errors import UasflyError

    check_writable(log, "log")
    seen_with = load_sight(sight, None, None)
    if seen_with is None or not sight.bundles:
        raise UasflyError(
            "--connect needs the camera's file, its frames and a bundle: --camera, --camera-source, --bundle"
        )
    with RecordingProgress() as progress:
        record_hand_held(url, seen_with, log, duration_s, progress.update, system_id)


def _print_table(fit: MountingFit, stated: Camera, record: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    seen, motion, shown = record["sightings"], record["motion"], record["disturbances"]
    table = Table(title=f"Mounting of {stated.name} from {seen['used']} sightings in {motion['seconds']:.0f} s")
    for title in ("body axis", "position [m]", "sigma [mm]", "moved by [mm]", "turned by [deg]", "sigma [deg]"):
        table.add_column(title, justify="right")
    for index, axis in enumerate(_AXES):
        table.add_row(
            axis,
            f"{fit.unknowns.lever[index]:+.4f}",
            f"{1000.0 * record['sigmas']['position_m'][index]:.1f}",
            f"{1000.0 * record['moved_m'][index]:+.1f}",
            f"{record['turned_deg'][index]:+.3f}",
            f"{record['sigmas']['turn_deg'][index]:.3f}",
        )
    console = Console()
    console.print(table)
    told = [
        f"time offset {1000.0 * record['time_offset_s']:+.2f} ms (sigma {1000.0 * record['time_offset_sigma_s']:.2g}); "
        f"heading error {record['heading_error_deg']:+.2f} deg (sigma {record['heading_error_sigma_deg']:.2f})",
        f"residuals {1000.0 * seen['position_rms_m']:.1f} mm and {seen['rotation_rms_deg']:.2f} deg RMS; "
        f"{seen['left_out']} sightings left out",
        f"position scatters by {shown['position_white_m']:.2g} m and walks by {shown['position_walk_m_sqrt_s']:.2g} "
        f"m/√s; attitude wanders by {shown['attitude_wander_deg']:.2g} deg",
        f"motion: yaw {motion['yaw_deg']:.0f}, roll {motion['roll_deg']:.1f}, pitch {motion['pitch_deg']:.1f} deg, "
        f"way {motion['way_m']:.1f} m",
    ]
    for line in told:
        console.print(Text(line))
    if seen["left_out"] > 0.2 * (seen["used"] + seen["left_out"]):
        console.print(Text("many sightings contradict the rest: was the bundle moved?", style="yellow"))
    if not record["log_complete"]:
        console.print(Text("the log breaks off; what it holds was used", style="yellow"))
    if not record["known"]:
        console.print(Text(f"not known well enough, nothing was written. {_sentence(record)}", style="yellow"))
    elif record["file"] is None:
        print("nothing was written: name the camera file with --out")
    if record["file"] is not None:
        print(f"{record['file']}: mounting written")
    if record["picture"] is not None:
        print(f"{record['picture']}: residuals")


def _sentence(record: dict[str, Any]) -> str:
    text: str = record["missing"]["text"]
    return text[:1].upper() + text[1:]
