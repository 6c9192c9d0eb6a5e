"""Options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Airframe = Annotated[str, typer.Option("--airframe", help="Airframe: a shipped name (f550) or a YAML file.")]
Scenario = Annotated[
    str, typer.Option("--scenario", help="Scenario of the built-in simulation: a shipped name or a YAML file.")
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random in the simulation.")]
Controller = Annotated[
    str,
    typer.Option(
        "--controller",
        help="Controller: nmpc; pid (backup PIDs); pid_dd (PIDs with the acceleration's error); "
        "pid_dd_wind (those, tilted against the estimated wind).",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Change a field of a file for this flight, e.g. airframe.model.drag_1_s=[0.3,0.3,0.3] "
        "or mission.takeoff.height_m=2; may be given several times.",
    ),
]
Camera = Annotated[
    str | None,
    typer.Option(
        "--camera",
        help="Camera: a shipped name (vga) or a YAML file; none; or, in rehearsals, model or model:FILE for the noise "
        "model instead of rendered pictures. A mission that flies by a bundle has one anyway in simulations.",
    ),
]
Bundles = Annotated[
    list[str] | None,
    typer.Option(
        "--bundle",
        help="Bundle of markers to look for: a shipped name or a YAML file; may be given several times. "
        "Without it the mission's own, or the first of the scenario.",
    ),
]
CameraSource = Annotated[
    str | None,
    typer.Option(
        "--camera-source",
        help="Where frames come from in flight: index (0), device, rtsp:// or http:// stream, video file or folder; "
        "not needed with --sim.",
    ),
]
Log = Annotated[Path | None, typer.Option("--log", help="Flight log (MCAP; opens in Foxglove and PlotJuggler).")]
Summary = Annotated[Path | None, typer.Option("--summary", help="Write the closing summary to this JSON file.")]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON instead of a table.")]
Capture = Annotated[
    Path | None,
    typer.Option("--capture", help="Write a picture (SVG) of the live view, half way through the legs, to this file."),
]
