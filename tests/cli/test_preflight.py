"""`uasfly preflight`: exit codes, JSON and table."""

from __future__ import annotations

import io
import json

import pytest
from rich.console import Console

from tests.cli.test_cli import _run
from tests.link.fake_vehicle import FakeVehicle
from tests.link.wires import UdpWire
from uasfly.cli.output import preflight_table
from uasfly.link.ports import free_udp_port

# What depends on the speed of this machine is made easy, so that the exit code does not.
EASY = ("--controller", "pid", "--set", "mission.monitors.telemetry.stale_s=0.5")
CHECKS = [
    {"name": "home", "verdict": "ok", "value": "0.1 m [away]", "why": "PX4 returns there", "remedy": ""},
    {"name": "gnss", "verdict": "warning", "value": "no fix", "why": "it matters", "remedy": "wait"},
    {"name": "COM_OBL_RC_ACT", "verdict": "stop", "value": "7 (disarm)", "why": "it falls", "remedy": "set it to 5"},
]


def test_all_is_well_with_the_simulated_vehicle() -> None:
    """Exit code 0 with warnings; --json prints the list alone, each check with the same five fields."""
    result = _run("preflight", "hover", "--sim", "--json", *EASY)
    assert result.returncode == 0, result.stderr
    checks = json.loads(result.stdout)
    assert len(checks) >= 20
    assert {tuple(check) for check in checks} == {("name", "verdict", "value", "why", "remedy")}
    assert {check["verdict"] for check in checks} == {"ok", "warning"}


def test_a_stop_ends_with_exit_code_1_and_says_what_to_do() -> None:
    """The table has every line, standard error the reason."""
    result = _run("preflight", "hover", "--sim", *EASY, "--set", "plant.parameters.COM_OBL_RC_ACT=7")
    assert result.returncode == 1
    assert "COM_OBL_RC_ACT: 7 (disarm): the vehicle falls" in result.stderr
    table = " ".join(result.stdout.replace("│", " ").split())
    assert "COM_OBL_RC_ACT" in table
    assert "set it to 5" in table
    assert "Traceback" not in result.stderr


def test_a_flight_that_is_stopped_prints_the_lines_too() -> None:
    """Exit code 1, outcome aborted, and the summary has the checks."""
    stop = ("--set", "plant.parameters.COM_OBL_RC_ACT=7", "--no-log")
    result = _run("hover", "--sim", *EASY, *stop)
    assert result.returncode == 1
    assert "Preflight" in result.stdout
    assert "aborted" in result.stdout
    as_json = _run("hover", "--sim", *EASY, *stop, "--json")
    assert as_json.returncode == 1
    summary = json.loads(as_json.stdout)
    assert summary["outcome"] == "aborted"
    assert "COM_OBL_RC_ACT" in [check["name"] for check in summary["preflight"] if check["verdict"] == "stop"]


@pytest.mark.parametrize("command", ["fly", "preflight"])
def test_two_vehicles_on_the_port_end_with_exit_code_2(command: str) -> None:
    """The message lists them and names the option."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), system_id=3), FakeVehicle(UdpWire(port), system_id=4):
        result = _run(command, "hover", "--connect", f"udpin://127.0.0.1:{port}")
    assert result.returncode == 2
    assert "heard 2: 3 (PX4), 4 (PX4)" in result.stderr
    assert "--system-id" in result.stderr


def test_the_table_shows_every_line_in_80_columns() -> None:
    """Verdict, name, value, why and what to do; brackets are no markup."""
    output = io.StringIO()
    Console(file=output, width=80).print(preflight_table(CHECKS))
    text = output.getvalue()
    assert max(map(len, text.splitlines())) <= 80
    words = " ".join(text.replace("│", " ").split())
    for check in CHECKS:
        assert all(check[key] in words for key in ("name", "verdict", "value", "why"))
    assert "→ set it to 5" in words
    assert words.count("→") == 3  # the heading's, and one a remedy


def test_a_summary_without_a_preflight_check_has_no_table_of_it() -> None:
    """A rehearsal's, for one."""
    result = _run("rehearse", "hover", "--set", "mission.legs[0].duration_s=1", timeout_s=300.0)
    assert result.returncode == 0, result.stderr
    assert "Preflight" not in result.stdout
