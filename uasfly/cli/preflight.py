"""`uasfly preflight`: is everything as it has to be for this mission? Connects and looks; nothing is armed or sent."""

from __future__ import annotations

import json

import typer

from uasfly.cli import options
from uasfly.cli.fly import Connect, EngageOption, ScenarioOfSim, Sim, SystemId

EXIT_FAILED = 1


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="preflight")(preflight)


def preflight(
    mission: str = typer.Argument(help="Mission: a shipped name (spiral) or a YAML file."),
    sim: Sim = False,
    connect: Connect = "udpin://0.0.0.0:14540",
    airframe: options.Airframe = "f550",
    scenario: ScenarioOfSim = None,
    seed: options.Seed = 1,
    controller: options.Controller = "nmpc",
    engage: EngageOption = None,
    system_id: SystemId = None,
    settings: options.Settings = None,
    as_json: bool = typer.Option(False, "--json", help="Print a JSON list: name, verdict, value, why, remedy."),
) -> None:
    """Check vehicle, link, computer and PX4's parameters against a mission; nothing is armed.

    The same checks come before every flight. Each says ok, warning or stop; exit code 1 where one says stop.

    Example: [bold]uasfly preflight spiral --connect udpin://0.0.0.0:14540 --airframe my_airframe.yaml[/]
    """
    from rich.console import Console

    from uasfly.cli.live_view import LiveView
    from uasfly.cli.output import preflight_table
    from uasfly.drivers.flight import Flight, fly_flight

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
        only_check=True,
    )
    with LiveView(mission, airframe) as view:
        result = fly_flight(flight, view.update, view.say)
    checks = result["preflight"]
    if as_json:
        print(json.dumps(checks, indent=2))
    elif checks:
        Console().print(preflight_table(checks))
    if result["outcome"] != "completed":
        typer.echo(f"uasfly: {result['reason']}", err=True)
        raise typer.Exit(EXIT_FAILED)
