"""`uasfly sim`: the simulated vehicle alone, for any ground station or program that speaks MAVLink."""

from __future__ import annotations

import typer

from uasfly.cli import options


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="sim")(sim)


def sim(
    airframe: options.Airframe = "f550",
    scenario: options.Scenario = "calm",
    seed: options.Seed = 1,
    remote: str = typer.Option("127.0.0.1:14540", "--remote", help="Where to send MAVLink: host:port (UDP)."),
    port: int = typer.Option(14580, "--port", min=0, max=65535, help="Own UDP port; 0 takes any free one."),
    system_id: int = typer.Option(1, "--system-id", min=1, max=255, help="MAVLink system id of the vehicle."),
) -> None:
    """Run the simulated PX4 vehicle in real time until Ctrl-C.

    While it runs it reads faults from its standard input, a line each, for example
    [bold]{kind: gnss_lost, duration_s: 20}[/] (kinds: see `uasfly schema scenario`, faults).

    Example: [bold]uasfly sim --airframe f550 --scenario gusty[/], then in another terminal
    [bold]uasfly hover --connect udpin://0.0.0.0:14540[/]
    """
    from uasfly.drivers.simulate import simulate

    def say(text: str) -> None:
        typer.echo(text, err=True)

    report = simulate(airframe, scenario, seed, remote=remote, port=port, system_id=system_id, say=say)
    say(f"{report.vehicle_s:.1f} s flown, {report.sent} messages sent, {report.setpoints} setpoints taken")
