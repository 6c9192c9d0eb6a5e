"""The link's latency on loopback: from telemetry that leaves the vehicle to the setpoint that comes back to it."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time

from uasfly.bench.timing import Figures, as_in_flight
from uasfly.drivers.flight import SWITCH_INTERVAL_S
from uasfly.drivers.plan import FlightPlan
from uasfly.errors import LinkError
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port
from uasfly.messages import OdometrySample, Setpoint
from uasfly.sim.mavlink.process import start_process

MOTION_TIMEOUT_S = 0.2
CONNECT_TIMEOUT_S = 10.0
SYSTEM_ID = 1


def measure_link(plan: FlightPlan, duration_s: float) -> Figures:
    """Answer each ODOMETRY of a simulated vehicle with a setpoint, as soon as it has come, for a while.

    The vehicle stands on the ground, disarmed: it takes the setpoints and does nothing. Nothing is computed between
    `poll` and `send`, so the time is that of the link alone: MAVSDK, decoding, coordinates, encoding, both ways.

    Raises:
        LinkError: the simulated vehicle does not answer, or takes no setpoints.
    """
    assert plan.plant is not None
    assert plan.scenario is not None
    port = free_udp_port()
    relay = subprocess.Popen(
        [sys.executable, "-m", "uasfly.bench.link_relay", str(port)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert relay.stdout is not None
        vehicle_port = int(relay.stdout.readline())
        with start_process(plan.plant, plan.scenario, plan.seed, remote_port=vehicle_port, local_port=0):
            switch_interval = sys.getswitchinterval()
            sys.setswitchinterval(SWITCH_INTERVAL_S)
            try:
                asyncio.run(_answer(f"udpin://127.0.0.1:{port}", plan.airframe.model.hover_thrust, duration_s))
            finally:
                sys.setswitchinterval(switch_interval)
        answer, _ = relay.communicate(timeout=CONNECT_TIMEOUT_S)
    finally:
        if relay.poll() is None:
            relay.kill()
            relay.wait()
    figures = Figures.of(json.loads(answer))
    if figures is None:
        raise LinkError("no setpoint has come back to the simulated vehicle")
    return figures


async def _answer(url: str, thrust: float, duration_s: float) -> None:
    link = await MavsdkLink.connect(url, system_id=SYSTEM_ID, timeout_s=CONNECT_TIMEOUT_S)
    try:
        with as_in_flight():
            end_s = time.monotonic() + duration_s
            while time.monotonic() < end_s:
                await link.wait_for_motion(MOTION_TIMEOUT_S)
                if any(isinstance(sample, OdometrySample) for sample in link.poll()):
                    link.send(Setpoint(time.monotonic(), 0.0, 0.0, 0.0, 0.0, thrust))
    finally:
        await link.close()
