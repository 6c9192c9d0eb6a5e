"""`uasfly check` and `uasfly schema`: are these files right, and what may stand in them."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from uasfly.cli import options


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command(name="check")(check)
    app.command(name="schema")(schema)


def check(
    files: list[str] = typer.Argument(
        help="Mission, airframe, scenario, plant, camera or bundle files, or shipped names."
    ),
    airframe: options.Airframe = "f550",
    as_json: bool = typer.Option(False, "--json", help="Print a JSON list of findings."),
) -> None:
    """Check files without flying: every error names file, line, field, what was expected and what was found.

    Missions are also held against the airframe: speed, acceleration, thrust headroom, geofence.

    Example: [bold]uasfly check my_mission.yaml --airframe f550[/]
    """
    from uasfly.drivers.checking import check_files

    findings = check_files(files, airframe)
    if as_json:
        print(json.dumps([finding.as_dict() for finding in findings], indent=2))
    else:
        for finding in findings:
            typer.echo(finding.text(), err=finding.severity == "error")
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(2)


def schema(
    kind: str = typer.Argument(help="mission, airframe, scenario, plant, camera or bundle."),
    out: Path | None = typer.Option(None, "--out", help="Write to this file instead of the screen."),
) -> None:
    """Print the JSON Schema of a kind of file, for editors that complete and check YAML.

    Example: [bold]uasfly schema mission --out mission.schema.json[/]
    """
    from uasfly.cli.output import check_writable
    from uasfly.drivers.checking import schema_of

    check_writable(out, "schema")
    text = json.dumps(schema_of(kind), indent=2)
    if out is None:
        print(text)
    else:
        out.write_text(text + "\n", encoding="utf-8")
