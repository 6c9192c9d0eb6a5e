"""`uasfly rehearse`: fly a mission in the built-in simulation, faster than real time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from uasfly.cli import options

if TYPE_CHECKING:  # imported where they are needed, so that the command line starts fast
    from uasfly.drivers.watching import Cycle
    from uasfly.messages import Status


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="rehearse")(rehearse)


def rehearse(
    mission: str = typer.Argument(help="Mission: a shipped name (spiral) or a YAML file."),
    airframe: options.Airframe = "f550",
    scenario: options.Scenario = "calm",
    seed: options.Seed = 1,
    controller: options.Controller = "nmpc",
    camera: options.Camera = None,
    bundles: options.Bundles = None,
    settings: options.Settings = None,
    log: options.Log = None,
    summary: options.Summary = None,
    as_json: options.Json = False,
    capture: options.Capture = None,
) -> None:
    """Fly a mission in this process: deterministic, faster than real time, no link.

    The same seed gives the same flight and the same log, bit for bit.

    Example: [bold]uasfly rehearse spiral --airframe f550 --scenario spiral_side --seed 3 --summary spiral.json[/]
    """
    from uasfly.cli.capture import Capture
    from uasfly.cli.output import check_writable, finish
    from uasfly.cli.progress import RehearsalProgress
    from uasfly.cli.scene import Recent
    from uasfly.drivers.checking import refuse_infeasible
    from uasfly.drivers.plan import load_plan
    from uasfly.drivers.rehearse import rehearse as run
    from uasfly.drivers.sight import SightOptions

    check_writable(log, "flight log")
    check_writable(summary, "summary")
    check_writable(capture, "picture")
    sight = SightOptions(camera, tuple(bundles or ()))
    plan = load_plan(
        mission, airframe, controller=controller, seed=seed, scenario=scenario, settings=settings, sight=sight
    )
    refuse_infeasible(plan.mission, plan.airframe, lambda text: typer.echo(text, err=True))
    picture = Capture(capture) if capture is not None else None
    recent = Recent(plan.mission.name)
    recent.plan(plan)
    with RehearsalProgress(plan.mission.name) as progress:

        def watch(status: Status, cycle: Cycle) -> None:
            progress.update(status)
            if picture is not None:
                recent.take(status, cycle)
                picture.look(recent)

        result = run(plan, log, watch)
    code = finish(result, summary, as_json=as_json)
    if picture is not None:
        picture.write()
    raise typer.Exit(code)
