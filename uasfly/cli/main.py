"""The command line: every command, and the one place where an error becomes a message and an exit code."""

from __future__ import annotations

import sys

import typer

from uasfly import __version__
from uasfly.cli import (
    bench,
    calibrate,
    campaign,
    check,
    faults,
    fly,
    identify,
    markers,
    preflight,
    rehearse,
    reproduce,
    sim,
)

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2

app = typer.Typer(
    name="uasfly",
    help="Flies PX4 multirotors accurately where GNSS is poor and the wind gusts.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"uasfly {__version__}")
        raise typer.Exit()


@app.callback()
def _root(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
) -> None:
    """Flies PX4 multirotors accurately where GNSS is poor and the wind gusts."""


fly.register(app)
preflight.register(app)
rehearse.register(app)
check.register(app)
sim.register(app)
faults.register(app)
bench.register(app)
markers.register(app)
campaign.register(app)
reproduce.register(app)
calibrate.register(app)
identify.register(app)


def main() -> None:
    """Entry point: wrong input ends with its message on stderr and exit code 2, anything unexpected with exit code 1.

    Tracebacks are for those who set UASFLY_DEBUG.
    """
    from uasfly.errors import UasflyError, describe_error

    try:
        app()
    except UasflyError as error:
        sys.stdout.flush()
        sys.stderr.write(f"uasfly: {error}\n")
        sys.exit(EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        sys.stderr.write("uasfly: interrupted\n")
        sys.exit(130)
    except Exception as error:
        sys.stderr.write(f"uasfly: {describe_error(error)}\n")
        sys.exit(EXIT_FAILED)
