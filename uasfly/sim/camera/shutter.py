"""Opens the shutter of a simulated camera as its vehicle flies, and keeps where the camera was then."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from uasfly.camera import Camera
from uasfly.frames import quaternion_from_rotation_vector, rotation_matrix
from uasfly.messages import Array
from uasfly.sim.camera.motion import CameraMotion, camera_motion
from uasfly.sim.camera.mount import Mount
from uasfly.sim.camera.settings import CameraSettings
from uasfly.sim.camera.timing import FrameClock

_STATE_LENGTH = 13


@dataclass(frozen=True, slots=True)
class Exposure:
    """All that a picture depends on, but for its noise.

    Attributes:
        sequence: counts the shots. exposed_s: mid-exposure. arrives_s: when the frame is there.
        since_s: time on the schedule's clock; negative before it runs.
        motion: of the camera.
        body_position: (3,) m, world. body_to_world: (3, 3).
    """

    sequence: int
    exposed_s: float
    arrives_s: float
    since_s: float
    motion: CameraMotion
    body_position: Array
    body_to_world: Array


class Shutter:
    """Watches a simulated vehicle step by step.

    Args:
        camera: as its file says it is mounted; the scenario may add errors and motion of the mount.
        settings: timing and mount.
        rng: of timing and mount.
    """

    def __init__(self, camera: Camera, settings: CameraSettings, rng: np.random.Generator) -> None:
        clock_rng, mount_rng = rng.spawn(2)
        latency_s = camera.latency_s if settings.latency_s is None else settings.latency_s
        self.exposure_s = settings.open_s(camera)
        self._clock = FrameClock(settings, latency_s, clock_rng)
        self._mount = Mount(settings.mount, mount_rng)
        self._schedule_s = 0.0 if settings.after == "boot" else math.inf  # when the schedule's clock starts
        placement = camera.transform_camera_to_body
        error = np.radians(settings.mounting_error_deg)
        self._camera_in_body = placement.position + np.array(settings.mounting_error_m)
        self._camera_to_body = placement.rotation @ rotation_matrix(quaternion_from_rotation_vector(error))
        self._before: tuple[float, Sequence[float]] | None = None
        self._taken: list[Exposure] = []

    def watch(self, time_s: float, state: Sequence[float], since_offboard_s: float | None) -> None:
        """Take the vehicle's true state after a step.

        Args:
            time_s: since the simulation began; grows from call to call.
            state: position [m], velocity [m/s] (world), quaternion body to world, body rates [rad/s]: 13 or more.
            since_offboard_s: time since the first offboard, None before.
        """
        now = (time_s, tuple(state[:_STATE_LENGTH]))
        before = now if self._before is None else self._before
        if since_offboard_s is not None and self._schedule_s == math.inf:
            self._schedule_s = time_s - since_offboard_s
        while self._clock.next_s <= time_s:
            self._shoot(before, now, time_s - self._schedule_s)
        self._before = now

    def take(self) -> list[Exposure]:
        """Exposures since the last call, oldest first, without those whose frames are lost."""
        taken, self._taken = self._taken, []
        return taken

    def _shoot(self, before: tuple[float, Sequence[float]], now: tuple[float, Sequence[float]], since_s: float) -> None:
        shot = self._clock.shoot(since_s)
        turned, rate = self._mount.at(shot.exposed_s, self.exposure_s)
        if shot.arrives_s is None:
            return
        position, velocity, body_to_world, angular_rate = _between(before, now, shot.exposed_s)
        mount = rotation_matrix(quaternion_from_rotation_vector(turned))
        motion = camera_motion(
            position,
            velocity,
            body_to_world,
            angular_rate,
            self._camera_in_body,
            mount @ self._camera_to_body,
            rate,
        )
        self._taken.append(
            Exposure(shot.sequence, shot.exposed_s, shot.arrives_s, since_s, motion, position, body_to_world)
        )


class Arrivals:
    """Exposures on their way, handed out when their frames arrive."""

    def __init__(self, shutter: Shutter) -> None:
        self._shutter = shutter
        self._under_way: deque[Exposure] = deque()

    def until(self, now_s: float) -> list[Exposure]:
        """Exposures whose frames have arrived by now, oldest first; each once."""
        self._under_way.extend(self._shutter.take())
        arrived: list[Exposure] = []
        while self._under_way and self._under_way[0].arrives_s <= now_s:
            arrived.append(self._under_way.popleft())
        return arrived


def _between(
    before: tuple[float, Sequence[float]], now: tuple[float, Sequence[float]], time_s: float
) -> tuple[Array, Array, Array, Array]:
    """Position, velocity, rotation and body rates at a time between two steps.

    From the step before on, with the mean of the rates that it has over this time: exact to the third order.
    """
    start_s, first = before[0], np.array(before[1])
    last = np.array(now[1])
    share = 0.0 if now[0] <= start_s else min(1.0, max(0.0, (time_s - start_s) / (now[0] - start_s)))
    ahead_s = share * (now[0] - start_s)
    rates = first + share * (last - first)
    position = first[0:3] + ahead_s * 0.5 * (first[3:6] + rates[3:6])
    turn = quaternion_from_rotation_vector(ahead_s * 0.5 * (first[10:13] + rates[10:13]))
    body_to_world = rotation_matrix(first[6:10] / np.linalg.norm(first[6:10])) @ rotation_matrix(turn)
    return position, rates[3:6], body_to_world, rates[10:13]
