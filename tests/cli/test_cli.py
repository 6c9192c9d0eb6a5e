"""The command line: help with examples, wrong input with one clear message and exit code 2, results as JSON."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

COMMANDS = ("hover", "back-and-forth", "spiral", "fly", "preflight", "rehearse", "sim", "check", "schema", "reproduce")


def _run(*arguments: str, timeout_s: float = 120.0) -> subprocess.CompletedProcess[str]:
    program = "from uasfly.cli.main import main; main()"
    return subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=timeout_s, check=False
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(command: str) -> None:
    """--help works and shows an example."""
    result = _run(command, "--help")
    assert result.returncode == 0
    assert f"uasfly {command}" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("rehearse", "nowhere"), "there is no mission of this name"),
        (("rehearse", "hover", "--airframe", "nothing"), "there is no airframe of this name"),
        (("rehearse", "hover", "--scenario", "storm"), "there is no scenario of this name"),
        (("rehearse", "hover", "--controller", "lqr"), "expected one of nmpc, pid"),
        (("rehearse", "hover", "--set", "speed"), "expected key=value"),
        (("rehearse", "hover", "--log", "missing/flight.mcap"), "folder for the flight log does not exist"),
        (("rehearse", "hover", "--summary", "missing/s.json"), "folder for the summary does not exist"),
        (("rehearse", "hover", "--capture", "missing/v.svg"), "folder for the picture does not exist"),
        (("hover", "--scenario", "gusty"), "add --sim"),
        (("preflight", "nowhere", "--sim"), "there is no mission of this name"),
        (("preflight", "hover", "--scenario", "gusty"), "add --sim"),
        (("preflight", "hover", "--connect", "carrier-pigeon://coop"), "accepted forms"),
        (("hover", "--sim", "--engage", "robot"), "expected auto or pilot"),
        (("hover", "--connect", "carrier-pigeon://coop"), "accepted forms"),
        (("check", "no_such_file.yaml"), "no such file"),
        (("schema", "aeroplane"), "expected one of mission"),
        (("sim", "--remote", "somewhere"), "expected host:port"),
        (("reproduce", "newton1687"), "expected one of asignacion2022"),
    ],
)
def test_wrong_input_ends_with_one_message_and_exit_code_2(arguments: tuple[str, ...], message: str) -> None:
    """The message says what was expected; there is no traceback."""
    result = _run(*arguments)
    assert result.returncode == 2
    assert message in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


def test_a_busy_port_is_said_before_anything_flies() -> None:
    """Another program on the port: the message names the port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        result = _run("hover", "--connect", f"udpin://127.0.0.1:{port}", "--no-log")
    assert result.returncode == 2
    assert str(port) in result.stderr
    assert "Traceback" not in result.stderr


def test_no_vehicle_is_said_after_the_time_out() -> None:
    """Nobody answers: one message that says what to check."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    result = _run("hover", "--connect", f"udpin://127.0.0.1:{port}", "--no-log")
    assert result.returncode == 2
    assert "no vehicle" in result.stderr
    assert "Traceback" not in result.stderr


def test_check_names_file_line_and_field(tmp_path: Path) -> None:
    """A wrong mission is told with its line and field, as text and as JSON."""
    path = tmp_path / "wrong.yaml"
    path.write_text(
        "name: wrong\ntakeoff: {height_m: 1.5}\nlegs:\n  - {type: hover, position_m: [0, 0], duration_s: 5}\n"
    )
    result = _run("check", str(path), "--json")
    assert result.returncode == 2
    (finding,) = json.loads(result.stdout)
    assert finding["severity"] == "error"
    assert "line 4" in finding["message"]
    assert "legs[0].position_m" in finding["message"]


def test_check_says_when_the_airframe_cannot_fly_the_mission(tmp_path: Path) -> None:
    """Too fast for the airframe: an error that names the leg."""
    path = tmp_path / "fast.yaml"
    path.write_text(
        "name: fast\ntakeoff: {height_m: 1.5}\nlegs:\n"
        "  - {type: line, to_m: [90, 0, 1.5], speed_m_s: 25, acceleration_m_s2: 2}\n"
    )
    result = _run("check", str(path), "--airframe", "f550")
    assert result.returncode == 2
    assert "legs[0]" in result.stderr


@pytest.mark.parametrize("kind", ["mission", "airframe", "scenario", "plant"])
def test_schema_is_valid_json_schema(kind: str) -> None:
    """The schema of each kind is printed as JSON with its properties."""
    result = _run("schema", kind)
    assert result.returncode == 0
    schema = json.loads(result.stdout)
    assert schema["$schema"].startswith("https://json-schema.org/")
    assert "name" in schema["properties"]


def test_rehearse_prints_and_writes_its_summary(tmp_path: Path) -> None:
    """--json and --summary hold the same, --capture a picture of it; exit code 0 for a completed flight."""
    path, picture = tmp_path / "summary.json", tmp_path / "view.svg"
    files = ("--summary", str(path), "--capture", str(picture))
    result = _run("rehearse", "hover", "--set", "mission.legs[0].duration_s=1", "--json", *files, timeout_s=300.0)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout) == json.loads(path.read_text())
    assert json.loads(result.stdout)["outcome"] == "completed"
    assert ">hover<" in picture.read_text(encoding="utf-8")


def test_an_aborted_flight_exits_with_1() -> None:
    """A vehicle that will not arm: aborted, the summary says why."""
    result = _run("rehearse", "hover", "--set", "scenario.sensors.velocity_noise_m_s=5", "--json", timeout_s=300.0)
    assert result.returncode == 1, result.stderr
    assert json.loads(result.stdout)["outcome"] == "aborted"
    assert json.loads(result.stdout)["reason"]
