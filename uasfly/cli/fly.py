"""`uasfly fly | hover | back-and-forth | spiral`: fly a mission over MAVSDK, on a real vehicle or the simulated one."""

from __future__ import annotations

import datetime
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from uasfly.cli import options

Sim = Annotated[bool, typer.Option("--sim", help="Start the built-in simulated vehicle and fly that.")]
Connect = Annotated[
    str,
    typer.Option(
        "--connect",
        help="Vehicle: udpin://0.0.0.0:14540, udpout://HOST:PORT, tcpout://HOST:PORT, serial:///dev/ttyACM0:921600.",
    ),
]
ScenarioOfSim = Annotated[
    str | None, typer.Option("--scenario", help="Scenario of the built-in simulation, with --sim (default calm).")
]
EngageOption = Annotated[
    str | None,
    typer.Option(
        "--engage",
        help="auto: uasfly arms, takes off and switches to offboard (default with --sim); "
        "pilot: it waits until the pilot does (default on a real link).",
    ),
]
SystemId = Annotated[int | None, typer.Option("--system-id", min=1, max=255, help="Fly only this MAVLink system.")]
NoLog = Annotated[bool, typer.Option("--no-log", help="Write no flight log.")]


SHIPPED = (
    ("hover", "hover", "stay at one point", "gusty"),
    ("back-and-forth", "back_and_forth", "to and fro along a line, with stops at both ends", "head_wind"),
    ("spiral", "spiral", "climb around a centre and face it", "spiral_side"),
)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command(name="fly")(fly)
    for name, mission, what, example in SHIPPED:
        app.command(name=name)(_command_for(mission, what, f"uasfly {name} --sim --scenario {example}"))


def fly(
    mission: str = typer.Argument(help="Mission: a shipped name (spiral) or a YAML file."),
    sim: Sim = False,
    connect: Connect = "udpin://0.0.0.0:14540",
    airframe: options.Airframe = "f550",
    scenario: ScenarioOfSim = None,
    seed: options.Seed = 1,
    controller: options.Controller = "nmpc",
    engage: EngageOption = None,
    system_id: SystemId = None,
    camera: options.Camera = None,
    bundles: options.Bundles = None,
    camera_source: options.CameraSource = None,
    settings: options.Settings = None,
    log: options.Log = None,
    no_log: NoLog = False,
    summary: options.Summary = None,
    as_json: options.Json = False,
    capture: options.Capture = None,
) -> None:
    """Fly a mission over MAVLink.

    Example: [bold]uasfly fly my_mission.yaml --connect udpin://0.0.0.0:14540 --airframe my_airframe.yaml[/]
    """
    from uasfly.cli.capture import Capture
    from uasfly.cli.live_view import LiveView
    from uasfly.cli.output import check_writable, finish
    from uasfly.drivers.flight import Flight, fly_flight
    from uasfly.drivers.sight import SightOptions

    check_writable(log, "flight log")
    check_writable(summary, "summary")
    check_writable(capture, "picture")
    flight = Flight(
        mission=mission,
        airframe=airframe,
        sim=sim,
        url=connect,
        scenario=scenario,
        seed=seed,
        controller=controller,
        engage=engage,
        system_id=system_id,
        settings=settings or [],
        log=None if no_log else log or _default_log(mission),
        sight=SightOptions(camera, tuple(bundles or ()), camera_source),
    )
    picture = Capture(capture) if capture is not None else None
    with LiveView(mission, airframe, capture=picture) as view:
        result = fly_flight(flight, view.update, view.say, view.plan)
    code = finish(result, summary, as_json=as_json)
    if picture is not None:
        picture.write()
    raise typer.Exit(code)


def _command_for(mission: str, what: str, example: str) -> Callable[..., None]:
    """The command that flies one shipped mission: `fly` without its first parameter."""
    parameters = list(inspect.signature(fly, eval_str=True).parameters.values())[1:]

    def command(**arguments: Any) -> None:
        fly(mission, **arguments)

    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__doc__ = f"Fly missions/{mission}.yaml: {what}.\n\n    Example: [bold]{example}[/]\n    "
    return command


def _default_log(mission: str) -> Path:
    stamp = datetime.datetime.now(datetime.UTC).strftime("%Y%m%d_%H%M%S")
    return Path(f"uasfly_{Path(mission).stem}_{stamp}.mcap")
