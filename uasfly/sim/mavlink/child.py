"""The simulated vehicle's own process: reads its job, serves until it is told to end or its parent is gone."""

from __future__ import annotations

import functools
import gc
import json
import os
import select
import sys
import threading
from queue import SimpleQueue
from typing import Any

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.sim.camera.process import CameraProcess
from uasfly.sim.camera.settings import BundlePlacement
from uasfly.sim.fault_lines import FaultLines
from uasfly.sim.faults import Fault
from uasfly.sim.mavlink.server import serve
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

PARENT_CHECK_INTERVAL_S = 0.2
USER_ERROR = 2


def main() -> None:
    """Run the job that one line of JSON on standard input describes (see `process`).

    Exits with code 2 where the user is to mend something; standard error says what.
    """
    job = json.loads(_read_line())
    stop, injected = threading.Event(), SimpleQueue[Fault]()
    threading.Thread(target=_watch_parent, args=(job["parent_pid"], stop, injected), daemon=True).start()
    try:
        vehicle = SimulatedVehicle(
            Plant.model_validate_json(job["plant"]),
            Scenario.model_validate_json(job["scenario"]),
            job["seed"],
            tuple(job["start_position"]),
            job["start_yaw_rad"],
        )
        camera = _start_camera(job)
        if camera is not None:
            vehicle.watcher = camera.feed.watch
        gc.collect()
        gc.freeze()  # what lives now lives to the end: collecting it again would only delay telemetry
        remote = (job["remote"][0], job["remote"][1])
        advanced = None if camera is None else camera.feed.send
        ready = functools.partial(_say_ready, camera)
        try:
            report = serve(vehicle, remote, job["local_port"], job["system_id"], stop, ready, injected, advanced)
        finally:
            if camera is not None:
                camera.stop()
    except UasflyError as error:
        print(error, file=sys.stderr, flush=True)
        sys.exit(USER_ERROR)
    print(json.dumps(report.as_dict()), flush=True)


def _start_camera(job: dict[str, Any]) -> CameraProcess | None:
    scenario = Scenario.model_validate_json(job["scenario"])
    if job["camera"] is None or scenario.camera is None:
        return None
    camera, bundle = Camera.model_validate_json(job["camera"]), Bundle.model_validate_json(job["bundle"])
    others = [
        (Bundle.model_validate_json(one), BundlePlacement.model_validate_json(place)) for one, place in job["others"]
    ]
    return CameraProcess(camera, bundle, scenario.camera, job["seed"], job["camera_port"], others)


def _say_ready(camera: CameraProcess | None, local_port: int) -> None:
    print(f"ready {local_port}" if camera is None else f"ready {local_port} {camera.url}", flush=True)


def _read_line() -> bytes:
    """The first line of standard input, and not a byte more: faults may follow."""
    line = b""
    while not line.endswith(b"\n") and (piece := os.read(0, 1)):
        line += piece
    return line


def _watch_parent(parent_pid: int, stop: threading.Event, injected: SimpleQueue[Fault]) -> None:
    """Take faults, and set `stop` when standard input ends; the parent's id counts too: others may hold the pipe."""
    lines = FaultLines(injected.put, lambda text: print(text, file=sys.stderr, flush=True))
    while os.getppid() == parent_pid:
        readable, _, _ = select.select((0,), (), (), PARENT_CHECK_INTERVAL_S)
        if readable:
            data = os.read(0, 4096)
            if not data:
                break
            lines.feed(data)
    stop.set()
