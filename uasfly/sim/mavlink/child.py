"""The simulated vehicle's own process: reads its job, serves until it is told to end or its parent is gone."""

from __future__ import annotations

import gc
import json
import os
import select
import sys
import threading

from uasfly.errors import UasflyError
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
    job = json.loads(sys.stdin.buffer.readline())
    stop = threading.Event()
    threading.Thread(target=_watch_parent, args=(job["parent_pid"], stop), daemon=True).start()
    try:
        vehicle = SimulatedVehicle(
            Plant.model_validate_json(job["plant"]),
            Scenario.model_validate_json(job["scenario"]),
            job["seed"],
            tuple(job["start_position"]),
            job["start_yaw_rad"],
        )
        gc.collect()
        gc.freeze()  # what lives now lives to the end: collecting it again would only delay telemetry
        remote = (job["remote"][0], job["remote"][1])
        report = serve(vehicle, remote, job["local_port"], job["system_id"], stop, _say_ready)
    except UasflyError as error:
        print(error, file=sys.stderr, flush=True)
        sys.exit(USER_ERROR)
    print(json.dumps(report.as_dict()), flush=True)


def _say_ready(local_port: int) -> None:
    print(f"ready {local_port}", flush=True)


def _watch_parent(parent_pid: int, stop: threading.Event) -> None:
    """Set `stop` when standard input ends; the parent's id is looked at too, since others may hold the pipe open."""
    while os.getppid() == parent_pid:
        readable, _, _ = select.select((0,), (), (), PARENT_CHECK_INTERVAL_S)
        if readable and not os.read(0, 1024):
            break
    stop.set()
