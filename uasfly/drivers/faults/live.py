"""Flies a case over MAVLink: uasfly and the vehicle as processes of their own, and something done to them."""

from __future__ import annotations

import contextlib
import json
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from uasfly.drivers.faults.case import BEGIN_S, Act, FaultCase
from uasfly.drivers.faults.outcome import OLDEST_S, Outcome, bad_setpoints, judge
from uasfly.drivers.faults.pulse import Pulse
from uasfly.drivers.faults.story import Story
from uasfly.drivers.faults.wire import Wire
from uasfly.drivers.plan import load_plan
from uasfly.errors import FileError
from uasfly.link.ports import free_udp_port
from uasfly.messages import FlightMode, Setpoint
from uasfly.record.reader import LogReader
from uasfly.sim.mavlink.process import start_process

# Signals as a shell in the foreground hands them on: after `nohup` they would be ignored, and no fault.
SIGNALS_AS_USUAL = "import signal as s; s.signal(s.SIGHUP, s.SIG_DFL); s.signal(s.SIGINT, s.default_int_handler)"
PROGRAM = f"{SIGNALS_AS_USUAL}; from uasfly.cli.main import main; main()"
PATIENCE_S = 180.0
AFTERWARDS_S = 4.0  # a killed program's vehicle is watched for so long
TWICE_S = 0.5
ATTEMPTS = 3
LATE_S = 0.1  # half of the age at which telemetry is stale
POLL_S = 0.01
UNDER_WAY_S = 0.03  # between the making of a setpoint and its leaving: a cycle, and what clocks are wrong by
MISBEHAVIOUR = {Act.HANG: "hang", Act.FAILING_SOLVER: "fail"}
SIGNALS = {Act.TERMINATE: signal.SIGTERM, Act.HANG_UP: signal.SIGHUP, Act.KILL: signal.SIGKILL}


def fly_live(case: FaultCase, seed: int) -> Outcome:
    """Fly a case in real time and hold it against what was expected.

    A flight that the machine itself held up tells nothing about uasfly: where it did not end as expected, it is flown
    again, at most twice.
    """
    for _ in range(ATTEMPTS - 1):
        outcome, held_up = _attempt(case, seed)
        if outcome.as_expected or not held_up:
            return outcome
    return _attempt(case, seed)[0]


def _attempt(case: FaultCase, seed: int) -> tuple[Outcome, bool]:
    """One flight, and whether something else kept the machine from flying it in real time."""
    plan = load_plan("hover", case.airframe, seed=seed, scenario=case.scenario, settings=case.all_settings)
    assert plan.plant is not None
    assert plan.scenario is not None
    limits = plan.airframe.limits
    bounds = (limits.tilt_rad, limits.thrust_min, limits.thrust_max)
    with tempfile.TemporaryDirectory() as folder, _wire() as wire, Pulse() as pulse:
        flight = _Program(case, wire, Path(folder))
        with start_process(plan.plant, plan.scenario, seed, remote_port=wire.vehicle_port) as vehicle, flight:
            flight.fly()
        story = flight.story()
    held_up = pulse.latest_s > LATE_S or vehicle.report is None or vehicle.report.slips > 0
    fault_s = story.legs_s + BEGIN_S if case.act is None or case.act in MISBEHAVIOUR else flight.acted_s
    problems = flight.problems + _on_the_wire(case, wire, fault_s, bounds)
    return judge(case, story, fault_s, bounds, problems), held_up


class _Program:
    """The running program, its files, and what is done to it."""

    def __init__(self, case: FaultCase, wire: Wire, folder: Path) -> None:
        self.problems: list[str] = []
        self.acted_s = math.nan
        self._said_last = ""
        self._case = case
        self._wire = wire
        self._logs = folder / "logs"
        self._logs.mkdir()
        self._log, self._kept, self._summary = self._logs / "flight.mcap", folder / "kept.mcap", folder / "summary.json"
        settings = [setting for setting in case.all_settings if setting.startswith(("mission.", "airframe."))]
        arguments = ["fly", "hover", "--airframe", case.airframe, "--engage", "auto"]
        arguments += ["--connect", f"udpin://127.0.0.1:{wire.program_port}"]
        arguments += ["--log", str(self._log), "--summary", str(self._summary)]
        arguments += [text for setting in settings for text in ("--set", setting)]
        if case.act in MISBEHAVIOUR:
            begin, duration = str(BEGIN_S), str(case.act_s)
            what = (MISBEHAVIOUR[case.act], begin, duration)
            head = ["-c", f"from uasfly.drivers.faults.misbehave import misbehave; misbehave(*{what}); {PROGRAM}"]
        else:
            head = ["-c", PROGRAM]
        self._command = [sys.executable, *head, *arguments]

    def __enter__(self) -> _Program:
        self._output = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            env={"OMP_NUM_THREADS": "1", **os.environ},
        )
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self.problems.append(f"the program does not end within {PATIENCE_S:.0f} s")
            self._process.kill()
            self._process.wait()
        self._said_last = self._said()
        self._output.close()

    def fly(self) -> None:
        """Wait for offboard, do what is to be done, and wait for the end."""
        act = self._case.act
        deadline = time.monotonic() + PATIENCE_S
        if act is not None and act not in MISBEHAVIOUR:
            while math.isnan(self._wire.offboard_s) or time.monotonic() < self._wire.offboard_s + BEGIN_S:
                if self._process.poll() is not None or time.monotonic() > deadline:
                    self.problems.append(f"the flight never began:\n{self._said()}")
                    return
                time.sleep(POLL_S)
            self.acted_s = time.monotonic()
            self._act(act)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(max(0.0, deadline - time.monotonic()))
        if act is Act.KILL:
            time.sleep(AFTERWARDS_S)
        if "Traceback" in self._said():
            self.problems.append(f"a traceback:\n{self._said()}")

    def story(self) -> Story:
        """What happened, from the log as far as it goes, and from the wire."""
        story = Story()
        try:
            log = self._kept if self._kept.exists() else self._log
            story.read((entry.log_time_s, entry.message) for entry in LogReader(log).messages())
        except FileError as error:
            self.problems.append(f"{error}; the program said:\n{self._said_last}")
        story.truths = self._wire.truths
        ended = bool(story.words) and story.words[-1][1] in ("completed", "aborted")
        if not ended and self._summary.exists():
            summary = json.loads(self._summary.read_text())
            story.words.append((time.monotonic(), summary["outcome"]))
            story.reason = summary["reason"]
        elif not ended and self._case.act is Act.KILL:
            story.words.append((self.acted_s, "killed"))
            last = self._wire.modes[-1] if self._wire.modes else (math.nan, FlightMode.OTHER)
            story.words.append((last[0], f"vehicle in {last[1].value}"))
        if not ended:  # the log broke off: the wire tells what it does not
            story.ended_s = self._wire.left_offboard_s()
            story.texts += self._wire.texts
        if math.isnan(story.ended_s) and story.truths:
            story.ended_s = story.truths[-1].time_s
        return story

    def _act(self, act: Act) -> None:
        process = self._process
        match act:
            case Act.FREEZE:
                process.send_signal(signal.SIGSTOP)
                time.sleep(self._case.act_s)
                process.send_signal(signal.SIGCONT)
            case Act.CTRL_C:
                process.send_signal(signal.SIGINT)
            case Act.CTRL_C_TWICE:
                process.send_signal(signal.SIGINT)
                time.sleep(TWICE_S)
                process.send_signal(signal.SIGINT)
            case Act.DISK_FULL:
                size = self._log.stat().st_size
                resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (size + 20_000, size + 20_000))
            case Act.FOLDER_GONE:
                os.link(self._log, self._kept)
                shutil.rmtree(self._logs)
            case _:
                process.send_signal(SIGNALS[act])

    def _said(self) -> str:
        descriptor = self._output.fileno()
        return os.pread(descriptor, os.fstat(descriptor).st_size, 0).decode(errors="replace")


def _on_the_wire(case: FaultCase, wire: Wire, fault_s: float, bounds: tuple[float, float, float]) -> list[str]:
    """What is wrong with the setpoints as the vehicle would get them."""
    moves_clock = any(fault["kind"] in ("reboot", "clock_jump") for fault in case.faults)
    sent = wire.setpoints
    if case.act is Act.FREEZE:
        sent = without_one_under_way(sent, fault_s, case.act_s)
    problems = bad_setpoints(((0.0 if moves_clock else age, setpoint) for _, age, setpoint in sent), bounds)
    if case.act in (Act.FREEZE, Act.HANG, Act.KILL):
        until = math.inf if case.act is Act.KILL else fault_s + case.act_s
        late = [arrival - fault_s for arrival, _, _ in wire.setpoints if fault_s + OLDEST_S < arrival < until - POLL_S]
        if case.act is Act.HANG:  # it begins with the first cycle in the window
            late = [after for after in late if after > OLDEST_S + 0.5 and after < case.act_s - 0.5]
        if late:
            problems.append(f"{len(late)} setpoints up to {max(late):.2f} s after the last good cycle")
    return problems


def without_one_under_way(
    sent: list[tuple[float, float, Setpoint]], stopped_s: float, for_s: float
) -> list[tuple[float, float, Setpoint]]:
    """Setpoints on the wire without the one that MAVSDK was writing when the process was stopped.

    uasfly judges the age right before it hands a setpoint over; MAVSDK needs some 0.2 ms from there to the socket. Of
    134 stops 2 fell into it, and that one setpoint leaves when the process goes on. Only the first to come afterwards,
    and made in the cycle that was stopped, can be it.

    Args:
        sent: (arrival [s], age [s], setpoint).
        stopped_s: when the process was stopped.
        for_s: for how long.
    """
    first = next((k for k, (arrival, _, _) in enumerate(sent) if arrival > stopped_s + for_s - POLL_S), len(sent))
    under_way = [entry for entry in sent[first : first + 1] if abs(entry[0] - entry[1] - stopped_s) < UNDER_WAY_S]
    return sent[:first] + sent[first + len(under_way) :]


@contextlib.contextmanager
def _wire() -> Iterator[Wire]:
    wire = Wire(free_udp_port())
    wire.start()
    try:
        yield wire
    finally:
        wire.close()
