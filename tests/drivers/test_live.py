"""Real flights: uasfly as a process of its own, over MAVSDK and MAVLink, against the simulated vehicle in another."""

from __future__ import annotations

import json
import math
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from uasfly.messages import (
    FlightMode,
    OdometrySample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    Setpoint,
    Status,
    TruthSample,
    VehicleSample,
)
from uasfly.record.reader import LogReader

PATIENCE_S = 180.0  # for a flight's next phase, on a machine that is busy
GONE_S = 3.0
LAST_SECOND_S = 1.0
STARVED_S = 0.5  # a busy machine may have kept the killed process waiting for so long

PROGRAM = "from uasfly.cli.main import main; main()"


class LiveFlight:
    """A running `uasfly hover --sim`, its plain lines, and the process of its vehicle."""

    def __init__(self, process: subprocess.Popen[bytes], folder: Path) -> None:
        self.process = process
        self.log, self.summary = folder / "flight.mcap", folder / "summary.json"
        self.text = ""
        self.vehicle_pid = 0
        self.exit_code: int | None = None
        self.vehicle_gone = False
        self.killed_s = math.nan

    def wait_for(self, text: str) -> None:
        """Wait until uasfly has said something."""
        deadline = time.monotonic() + PATIENCE_S
        while text not in self.text:
            assert time.monotonic() < deadline, f"{text!r} was not said in:\n{self.text}"
            if not self._read(0.5):
                raise AssertionError(f"uasfly ended without saying {text!r}:\n{self.text}")
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        (self.vehicle_pid,) = map(int, children)

    def wait(self) -> int:
        """Wait for the end and return the exit code."""
        deadline = time.monotonic() + PATIENCE_S
        while self._read(0.5):
            assert time.monotonic() < deadline, f"uasfly does not end:\n{self.text}"
        return self.process.wait(PATIENCE_S)

    def vehicle_is_gone(self) -> bool:
        """Whether the simulated vehicle's process has ended, or does so soon."""
        assert self.vehicle_pid
        deadline = time.monotonic() + GONE_S
        while _is_running(self.vehicle_pid):
            if time.monotonic() > deadline:
                return False
            time.sleep(0.02)
        return True

    def messages(self, *kinds: type[Any]) -> list[Any]:
        """What the log holds of some kinds, in its order."""
        return [entry.message for entry in LogReader(self.log).messages() if isinstance(entry.message, kinds)]

    def is_complete(self) -> bool:
        """Whether the log was closed in order."""
        reader = LogReader(self.log)
        for _ in reader.messages():
            pass
        return reader.complete

    def result(self) -> dict[str, Any]:
        """The summary."""
        summary: dict[str, Any] = json.loads(self.summary.read_text())
        return summary

    def _read(self, timeout_s: float) -> bool:
        """Read what has been said; False at the end."""
        assert self.process.stderr is not None
        descriptor = self.process.stderr.fileno()
        if select.select((descriptor,), (), (), timeout_s)[0]:
            data = os.read(descriptor, 65536)
            self.text += data.decode()
            return bool(data)
        return True


def _is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@contextmanager
def _flight(folder: Path, hover_s: float) -> Iterator[LiveFlight]:
    arguments = ["hover", "--sim", "--set", f"mission.legs[0].duration_s={hover_s:g}"]
    files = ["--log", str(folder / "flight.mcap"), "--summary", str(folder / "summary.json")]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *arguments, *files],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    flight = LiveFlight(process, folder)
    try:
        yield flight
    finally:
        process.kill()  # nothing is left running, not even by a failing test
        process.wait()
        assert process.stderr is not None
        process.stderr.close()


def _complete(folder: Path) -> LiveFlight:
    with _flight(folder, hover_s=3.0) as flight:
        flight.wait_for("phase legs")
        flight.exit_code = flight.wait()
        flight.vehicle_gone = flight.vehicle_is_gone()
    return flight


def _interrupt(folder: Path) -> LiveFlight:
    with _flight(folder, hover_s=100.0) as flight:
        flight.wait_for("phase legs")
        flight.process.send_signal(signal.SIGINT)
        flight.exit_code = flight.wait()
        flight.vehicle_gone = flight.vehicle_is_gone()
    return flight


def _kill(folder: Path) -> LiveFlight:
    with _flight(folder, hover_s=100.0) as flight:
        flight.wait_for("phase legs")
        time.sleep(2.0)
        flight.killed_s = time.monotonic()
        flight.process.kill()
        flight.vehicle_gone = flight.vehicle_is_gone()
        flight.exit_code = flight.wait()
    return flight


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> dict[str, LiveFlight]:
    """Three flights at the same time, because they take as long as they take."""
    scripts = {"completed": _complete, "interrupted": _interrupt, "killed": _kill}
    with ThreadPoolExecutor(len(scripts)) as threads:
        futures = {name: threads.submit(fly, tmp_path_factory.mktemp(name)) for name, fly in scripts.items()}
        return {name: future.result() for name, future in futures.items()}


def test_a_flight_over_mavlink_completes_and_leaves_nothing_behind(flights: dict[str, LiveFlight]) -> None:
    """Outcome, log and summary are whole; the vehicle has landed and its process is gone."""
    flight = flights["completed"]
    assert flight.exit_code == 0, flight.text
    assert flight.vehicle_gone
    assert "Traceback" not in flight.text
    summary = flight.result()
    assert (summary["outcome"], summary["reason"]) == ("completed", "")
    assert summary["tracking_against"] == "truth"
    assert summary["setpoint_rate_hz"] > 0.0
    assert flight.is_complete()
    assert LogReader(flight.log).description()["mission"]["name"] == "hover"
    statuses = flight.messages(Status)
    phases = list(dict.fromkeys(status.phase for status in statuses))
    assert phases == [phase for phase in Phase if phase is not Phase.ABORTED]
    flown = [status for status in statuses if status.leg_started]
    assert len(flight.messages(Setpoint)) >= len(flown) > 50
    assert flight.messages(OdometrySample)
    assert flight.messages(TruthSample)
    asked = [request.kind for request in flight.messages(Request)]
    assert asked == [RequestKind.ARM, RequestKind.TAKEOFF, RequestKind.OFFBOARD, RequestKind.LAND]
    assert [result.accepted for result in flight.messages(RequestResult)] == [True] * 4
    assert not flight.messages(VehicleSample)[-1].armed


def test_an_interrupt_in_the_legs_holds_and_lands(flights: dict[str, LiveFlight]) -> None:
    """Ctrl-C once: hold, land, aborted with the reason; log and summary are whole, nothing is left running."""
    flight = flights["interrupted"]
    assert flight.exit_code == 1, flight.text
    assert flight.vehicle_gone
    assert "Traceback" not in flight.text
    assert "stopped by Ctrl-C: holding, then land" in flight.text
    summary = flight.result()
    assert (summary["outcome"], summary["reason"]) == ("aborted", "stopped by Ctrl-C")
    assert flight.is_complete()
    assert flight.messages(Status)[-1].reason == "stopped by Ctrl-C"
    asked = [request.kind for request in flight.messages(Request)]
    assert asked[-2:] == [RequestKind.HOLD, RequestKind.LAND]
    modes = list(dict.fromkeys(vehicle.mode for vehicle in flight.messages(VehicleSample)))
    assert modes.index(FlightMode.OFFBOARD) < modes.index(FlightMode.LAND)
    assert not flight.messages(VehicleSample)[-1].armed


def test_a_killed_uasfly_leaves_its_log_and_no_vehicle(flights: dict[str, LiveFlight]) -> None:
    """SIGKILL in the legs: the log reads up to the last second, and the simulated vehicle's process goes by itself."""
    flight = flights["killed"]
    assert flight.exit_code == -signal.SIGKILL
    assert flight.vehicle_gone
    assert not flight.is_complete()
    last = flight.messages(Status)[-1]
    assert last.phase is Phase.LEGS
    assert last.time_s >= flight.killed_s - LAST_SECOND_S - STARVED_S
    assert not flight.summary.exists()
