"""From the simulated vehicle's process to the camera's: exposures, one JSON line each."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.shutter import Exposure, Shutter

_PIPE_BYTES = 4096  # no longer line is written in one piece


class ExposureFeed:
    """Watches a vehicle that lives in real time and writes what its camera exposes into a pipe.

    It never waits: what a full pipe does not take is lost, as frames are.

    Args:
        shutter: the camera's.
        descriptor: of the pipe; it is set not to block.
    """

    def __init__(self, shutter: Shutter, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self._shutter = shutter
        self._descriptor = descriptor
        self._time_s = 0.0
        self.lost = 0

    def watch(self, time_s: float, state: Sequence[float], since_offboard_s: float | None) -> None:
        """See `Shutter.watch`."""
        self._time_s = time_s
        self._shutter.watch(time_s, state, since_offboard_s)

    def send(self, host_s: float) -> None:
        """Write what has been exposed since the last call.

        Args:
            host_s: time on the host's monotonic clock at which the vehicle is where its last step has put it.
        """
        ahead_s = host_s - self._time_s
        for it in self._shutter.take():
            line = exposure_line(replace(it, exposed_s=it.exposed_s + ahead_s, arrives_s=it.arrives_s + ahead_s))
            try:
                self.lost += os.write(self._descriptor, line) < len(line)
            except OSError:
                self.lost += 1


def exposure_line(exposure: Exposure) -> bytes:
    """One exposure as a line of JSON, shorter than a pipe writes in one piece."""
    motion = exposure.motion
    line = json.dumps(
        {
            "sequence": exposure.sequence,
            "times": [exposure.exposed_s, exposure.arrives_s],
            "since": exposure.since_s if math.isfinite(exposure.since_s) else None,
            "motion": [
                motion.position_in_world.tolist(),
                motion.rotation_camera_to_world.tolist(),
                motion.velocity_in_world.tolist(),
                motion.angular_rate_in_camera.tolist(),
            ],
            "body": [exposure.body_position.tolist(), exposure.body_to_world.tolist()],
        }
    ).encode()
    assert len(line) < _PIPE_BYTES
    return line + b"\n"


def read_exposure(line: bytes) -> Exposure:
    """What `exposure_line` wrote.

    Raises:
        ValueError: the line is damaged.
    """
    try:
        fields = json.loads(line)
        since_s = -math.inf if fields["since"] is None else float(fields["since"])
        motion = CameraMotion(*(np.array(part, dtype=float) for part in fields["motion"]))
        position, rotation = (np.array(part, dtype=float) for part in fields["body"])
        exposed_s, arrives_s = fields["times"]
        return Exposure(int(fields["sequence"]), exposed_s, arrives_s, since_s, motion, position, rotation)
    except (KeyError, TypeError) as error:
        raise ValueError(f"expected an exposure, found {line[:40]!r}: {error}") from None
