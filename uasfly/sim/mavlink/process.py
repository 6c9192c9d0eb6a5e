"""A simulated vehicle in a process of its own.

Parent and child share three pipes: the parent writes the job (one line of JSON) to the child's standard input and then
holds it open, for faults (a line of JSON each) and so that its end tells the child that the parent is gone, however it
went; the child writes "ready PORT" to its standard output, and a report when it ends; what it has to complain about
goes to a temporary file.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from types import TracebackType
from typing import IO, Self

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import LinkError
from uasfly.sim.camera.settings import BundlePlacement
from uasfly.sim.faults import Fault
from uasfly.sim.mavlink.channel import DEFAULT_REMOTE
from uasfly.sim.mavlink.server import ServerReport
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario

READY_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 5.0


class SimulatedVehicleProcess:
    """Handle of a running simulated vehicle; also a context manager that stops it.

    Attributes:
        local_port: UDP port on which the vehicle listens, 0 before it does.
        camera_url: of its camera's stream, "" without a camera.
        report: what the vehicle has done, None until it has been stopped.
    """

    def __init__(self, process: subprocess.Popen[bytes], complaints: IO[bytes]) -> None:
        self._process = process
        self._complaints = complaints
        self.local_port = 0
        self.camera_url = ""
        self.report: ServerReport | None = None

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the vehicle still runs."""
        return self._process.poll() is None

    def complaints(self) -> str:
        """What the vehicle has written to its standard error so far."""
        descriptor = self._complaints.fileno()
        # the child writes at the file's position, which it shares with us: read without moving it
        return os.pread(descriptor, os.fstat(descriptor).st_size, 0).decode(errors="replace").strip()

    def stop(self) -> ServerReport | None:
        """End the vehicle and wait for it; a second call does nothing.

        Returns:
            Its report, None where it could not give one.
        """
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        if process.stdout.closed:
            return self.report
        if not self.local_port:  # it does not serve yet, so there is nothing to end in order
            process.kill()
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        lines = process.stdout.read().splitlines()
        process.stdout.close()
        if lines:
            with contextlib.suppress(ValueError, TypeError):
                self.report = ServerReport(**json.loads(lines[-1]))
        return self.report

    def inject(self, fault: Fault) -> None:
        """Let a fault begin now; nothing happens where the vehicle has ended."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(fault.model_dump_json().encode() + b"\n")
            self._process.stdin.flush()

    def wait_until_ready(self, timeout_s: float) -> None:
        """Wait for the vehicle to answer on its port.

        Raises:
            LinkError: it ended or said nothing in time; the text tells its own words.
        """
        assert self._process.stdout is not None
        deadline = time.monotonic() + timeout_s
        line = b""
        while not line.endswith(b"\n"):
            readable, _, _ = select.select((self._process.stdout,), (), (), max(0.0, deadline - time.monotonic()))
            piece = os.read(self._process.stdout.fileno(), 1) if readable else b""
            if not piece:
                self.stop()
                words = self.complaints() or f"no answer within {timeout_s:g} s"
                error = LinkError(f"the simulated vehicle did not start: {words.splitlines()[-1]}")
                error.add_note(words)
                raise error
            line += piece
        words_said = line.decode().split()
        self.local_port = int(words_said[1])
        self.camera_url = words_said[2] if len(words_said) > 2 else ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def start_process(
    plant: Plant,
    scenario: Scenario,
    seed: int,
    remote_port: int = DEFAULT_REMOTE[1],
    remote_host: str = DEFAULT_REMOTE[0],
    local_port: int = 0,
    system_id: int = 1,
    start_position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start_yaw_rad: float = 0.0,
    ready_timeout_s: float = READY_TIMEOUT_S,
    camera: Camera | None = None,
    bundle: Bundle | None = None,
    camera_port: int = 0,
    others: Sequence[tuple[Bundle, BundlePlacement]] = (),
) -> SimulatedVehicleProcess:
    """Start a simulated vehicle in a process of its own and wait until it answers.

    The process ends when the handle is stopped and when this process ends in any way. It is no fork of this process,
    and Ctrl-C in the terminal does not reach it: whoever started it decides when it goes.

    Args:
        plant: the vehicle.
        scenario: wind and sensors.
        seed: of everything random.
        remote_port: where its telemetry goes.
        remote_host: where its telemetry goes.
        local_port: its own UDP port, 0 for any that is free.
        system_id: its MAVLink system id; the component is 1.
        start_position: (3,) m, world.
        start_yaw_rad: 0 = east, counter-clockwise.
        ready_timeout_s: how long to wait for it.
        camera: its camera, served as an MJPEG stream where the scenario has a section `camera`.
        bundle: what the camera looks at; needed with `camera`.
        camera_port: TCP port of that stream, 0 for any that is free.
        others: more bundles and where they are.

    Raises:
        LinkError: it could not start; the text says why.
    """
    job = {
        "plant": plant.model_dump_json(),
        "scenario": scenario.model_dump_json(),
        "seed": seed,
        "remote": (remote_host, remote_port),
        "local_port": local_port,
        "system_id": system_id,
        "start_position": start_position,
        "start_yaw_rad": start_yaw_rad,
        "parent_pid": os.getpid(),
        "camera": None if camera is None or bundle is None else camera.model_dump_json(exclude_none=True),
        "bundle": None if bundle is None else bundle.model_dump_json(exclude_none=True),
        "camera_port": camera_port,
        "others": [(one.model_dump_json(exclude_none=True), place.model_dump_json()) for one, place in others],
    }
    complaints = tempfile.TemporaryFile()  # noqa: SIM115 - the handle reads it as long as it lives
    process = subprocess.Popen(
        [sys.executable, "-m", "uasfly.sim.mavlink"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=complaints,
        start_new_session=True,
        env={"OMP_NUM_THREADS": "1", **os.environ},
    )
    handle = SimulatedVehicleProcess(process, complaints)
    try:
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died at once: waiting for it tells why
            process.stdin.write(json.dumps(job).encode() + b"\n")
            process.stdin.flush()
        handle.wait_until_ready(ready_timeout_s)
    except BaseException:
        handle.stop()
        raise
    return handle
