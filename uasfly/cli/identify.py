"""`uasfly identify`: figures of an airframe from the logs of its flights."""

from __future__ import annotations

import json
import math
from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="Figures of an airframe from the logs of its flights.", no_args_is_help=True)
    group.command("drag")(drag)
    app.add_typer(group, name="identify")


def drag(
    logs: list[Path] = typer.Argument(help="Flight logs of uasfly (MCAP): to and fro at several speeds, in calm air."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object."),
) -> None:
    """Drag against airspeed, as the section `wind` of an airframe file.

    The shipped mission drag flies what it takes; the faster, the better strong wind is known.

    Example: [bold]uasfly fly drag --airframe my.yaml --log d.mcap[/], then
    [bold]uasfly identify drag d.mcap[/]
    """
    from uasfly.identify.drag import identify_drag, moments
    from uasfly.identify.flight_log import estimates_in_air

    found = identify_drag([moments(estimates_in_air(log)) for log in logs])
    linear, quadratic = (math.sqrt(found.covariance[k, k]) for k in (0, 1))
    if as_json:
        figures = {
            "drag_1_s": found.drag_1_s,
            "drag_1_m": found.drag_1_m,
            "covariance": found.covariance.tolist(),
            "drag_sigma_share": found.share,
            "winds_m_s": found.winds.tolist(),
            "residual_m_s": found.residual_m_s,
            "fastest_m_s": found.fastest_m_s,
            "moments": found.moments,
        }
        print(json.dumps(figures, indent=2))
        return
    typer.echo(f"linear drag     {found.drag_1_s:.4f} ± {linear:.4f} 1/s")
    typer.echo(f"quadratic drag  {found.drag_1_m:.5f} ± {quadratic:.5f} 1/m")
    typer.echo(
        f"seen up to {found.fastest_m_s:.1f} m/s, {found.moments} moments, residual {found.residual_m_s:.2f} m/s"
    )
    for log, (east, north) in zip(logs, found.winds.tolist(), strict=True):
        typer.echo(f"{log}: steady wind of {math.hypot(east, north):.2f} m/s")
    typer.echo(
        f"\nwind: {{ drag_1_s: {found.drag_1_s:.4f}, drag_1_m: {found.drag_1_m:.5f}, "
        f"drag_sigma_share: {found.share:.3f} }}"
    )
