"""`uasfly identify`: figures of an airframe from the logs of its flights."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # imported where they are needed, so that the command line starts fast
    from uasfly.identify.drag import IdentifiedDrag


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="Figures of an airframe from the logs of its flights.", no_args_is_help=True)
    group.command("drag")(drag)
    app.add_typer(group, name="identify")


def drag(
    logs: list[Path] = typer.Argument(help="Flight logs of uasfly (MCAP): to and fro at several speeds, in calm air."),
    write: str | None = typer.Option(
        None, "--write", help="Write the section into this airframe file; of a shipped one (f550) a copy is made here."
    ),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object."),
) -> None:
    """Drag against airspeed, as the section `wind` of an airframe file.

    The shipped mission drag flies what it takes; the faster, the better strong wind is known.

    Example: [bold]uasfly fly drag --airframe my.yaml --log d.mcap[/], then
    [bold]uasfly identify drag d.mcap --write my.yaml[/]
    """
    from uasfly.airframe_file import find_target
    from uasfly.identify.airframe_section import write_drag
    from uasfly.identify.drag import identify_drag, moments
    from uasfly.identify.flight_log import estimates_in_air

    target = None if write is None else find_target(write, "--write")
    found = identify_drag([moments(estimates_in_air(log)) for log in logs])
    if as_json:
        print(json.dumps(_figures(found), indent=2))
    else:
        _show(found, logs)
    if target is not None:
        changes = write_drag(target, found) or ["nothing to change"]
        typer.echo(f"{target.path}: {', '.join(changes)}", err=True)


def _figures(found: IdentifiedDrag) -> dict[str, object]:
    return {
        "drag_1_s": found.drag_1_s,
        "drag_1_m": found.drag_1_m,
        "covariance": found.covariance.tolist(),
        "drag_sigma_share": found.share,
        "winds_m_s": found.winds.tolist(),
        "residual_m_s": found.residual_m_s,
        "fastest_m_s": found.fastest_m_s,
        "moments": found.moments,
    }


def _show(found: IdentifiedDrag, logs: list[Path]) -> None:
    from uasfly.identify.airframe_section import section_line

    linear, quadratic = (math.sqrt(found.covariance[k, k]) for k in (0, 1))
    typer.echo(f"linear drag     {found.drag_1_s:.4f} ± {linear:.4f} 1/s")
    typer.echo(f"quadratic drag  {found.drag_1_m:.5f} ± {quadratic:.5f} 1/m")
    typer.echo(
        f"seen up to {found.fastest_m_s:.1f} m/s, {found.moments} moments, residual {found.residual_m_s:.2f} m/s"
    )
    for log, (east, north) in zip(logs, found.winds.tolist(), strict=True):
        typer.echo(f"{log}: steady wind of {math.hypot(east, north):.2f} m/s")
    typer.echo(f"\n{section_line(found)}")
