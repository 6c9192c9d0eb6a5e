"""Runs the simulated vehicle alone in this process, for any ground station or program that speaks MAVLink."""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable
from queue import SimpleQueue

from uasfly.airframe import Airframe
from uasfly.errors import UasflyError, shortened
from uasfly.files import find_file, load_file
from uasfly.sim.fault_lines import FaultLines
from uasfly.sim.faults import Fault
from uasfly.sim.mavlink.server import ServerReport, serve
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle


def simulate(
    airframe: str, scenario: str, seed: int, *, remote: str, port: int, system_id: int, say: Callable[[str], None]
) -> ServerReport:
    """Serve a vehicle in real time until SIGINT or SIGTERM; faults are read from standard input, a line each.

    Args:
        airframe: name of a shipped file or a path; it names the plant.
        scenario: name of a shipped file or a path.
        seed: of everything random.
        remote: "host:port" to send to.
        port: own UDP port, 0 for any free one.
        system_id: MAVLink system id of the vehicle.
        say: told in one line when the vehicle answers.

    Raises:
        UasflyError: wrong files or flags, or a busy port.
    """
    host, _, remote_port = remote.rpartition(":")
    if not host or not re.fullmatch("[0-9]{1,5}", remote_port) or not 0 < int(remote_port) < 65536:
        raise UasflyError(f"--remote: expected host:port, for example 127.0.0.1:14540, found {shortened(remote)!r}")
    plant_name = load_file(find_file("airframe", airframe), Airframe).plant
    plant = load_file(find_file("plant", plant_name), Plant)
    vehicle = SimulatedVehicle(plant, load_file(find_file("scenario", scenario), Scenario), seed)

    def ready(local_port: int) -> None:
        say(f"simulated {plant.name} in {scenario}: sends to udp {host}:{remote_port}, listens on {local_port}")

    injected: SimpleQueue[Fault] = SimpleQueue()
    threading.Thread(target=_listen, args=(injected, say), name="faults", daemon=True).start()
    return serve(vehicle, (host, int(remote_port)), port, system_id, None, ready, injected)


def _listen(injected: SimpleQueue[Fault], say: Callable[[str], None]) -> None:
    """Take faults from standard input until it ends; the vehicle flies on without it."""
    lines = FaultLines(injected.put, say)
    try:
        while data := os.read(0, 4096):
            lines.feed(data)
    except OSError:  # no standard input
        return
