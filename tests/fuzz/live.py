"""Datagrams into a real link: MAVSDK on a UDP socket, in a process of its own, beside a live simulated vehicle.

MAVSDK is native code: what it does not survive would take this process with it, so the link lives in a child.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.fuzz import frames
from tests.fuzz.file_targets import shelf
from tests.fuzz.harness import Rng
from tests.fuzz.link_target import check_sample
from tests.fuzz.odd import choice
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port
from uasfly.messages import OdometrySample, Setpoint
from uasfly.sim.mavlink.process import start_process
from uasfly.sim.scenario import Scenario

ROOT = Path(__file__).parents[2]
HEARD = ("ODOMETRY", "ATTITUDE_TARGET", "HEARTBEAT", "CURRENT_MODE", "EXTENDED_SYS_STATE", "ESTIMATOR_STATUS",
         "GPS_RAW_INT", "BATTERY_STATUS", "STATUSTEXT", "DEBUG_FLOAT_ARRAY", "HIL_STATE_QUATERNION", "TIMESYNC",
         "GPS_GLOBAL_ORIGIN", "COMMAND_ACK", "PARAM_VALUE", "HOME_POSITION", "AUTOPILOT_VERSION", "PING",
         "FILE_TRANSFER_PROTOCOL")  # fmt: skip
POLL_INTERVAL_S = 0.01
QUIET_S = 1.2
PATIENCE_S = 60.0


@dataclass(frozen=True, slots=True)
class LiveResult:
    """What is left after the datagrams.

    Attributes:
        exit_code: of the process with the link; negative where a signal has ended it.
        problem: what it has to complain about.
        samples: how many the link has given.
        fresh: odometry samples in the quiet time after the last datagram.
        vehicle_alive: whether the simulated vehicle has lived through it.
    """

    exit_code: int
    problem: str
    samples: int
    fresh: int
    vehicle_alive: bool


def bombard(seed: int, datagrams: int, interval_s: float = 0.0005) -> LiveResult:
    """Send odd datagrams to both ends of a live link, and look what is left of them."""
    rng = np.random.default_rng([seed, 77])
    port = free_udp_port()
    with (
        start_process(shelf("plant").models[0], Scenario(name="fuzz"), 1, remote_port=port) as vehicle,
        subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.live", str(port)],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as child,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):  # fmt: skip
        assert child.stdout is not None
        child.stdout.readline()  # it has connected, or ended
        for _ in range(datagrams):
            target = port if rng.random() < 0.8 else vehicle.local_port
            with contextlib.suppress(OSError):
                stranger.sendto(_datagram(rng), ("127.0.0.1", target))
            time.sleep(interval_s)
        time.sleep(QUIET_S)
        output, errors = child.communicate(timeout=PATIENCE_S)
        report = json.loads(output) if output else {"samples": 0, "fresh": 0}
        alive = vehicle.alive and not vehicle.complaints()
        return LiveResult(
            child.returncode, errors[-3000:].decode(errors="replace"), report["samples"], report["fresh"], alive
        )


def _datagram(rng: Rng) -> bytes:
    source = choice(rng, ((1, 1), (1, 1), (1, 1), (1, 2), (7, 1), (255, 190)))
    return frames.datagram(rng, source, HEARD if rng.random() < 0.7 else ())


async def _listen(port: int) -> None:
    """The child: poll a link until standard input ends, then tell what came."""
    link = await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", system_id=1, want_truth=True)
    print("connected", flush=True)
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    samples, odometry_s = 0, []
    while not ended.done():
        for sample in link.poll():
            check_sample(sample)
            samples += 1
            if isinstance(sample, OdometrySample):
                odometry_s.append(time.monotonic())
        link.send(Setpoint(time.monotonic(), 0.0, 0.0, 0.0, 0.0, 0.3))
        await asyncio.sleep(POLL_INTERVAL_S)
    ended_s = time.monotonic()
    await link.home()
    await link.close()
    fresh = sum(at_s > ended_s - 1.0 for at_s in odometry_s)
    print(json.dumps({"samples": samples, "fresh": fresh}), flush=True)


if __name__ == "__main__":
    asyncio.run(_listen(int(sys.argv[1])))
