"""Records a vehicle that is carried by hand, disarmed: telemetry and sightings into a log; nothing is sent to it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from uasfly.drivers.flight import CONNECT_TIMEOUT_S, LISTEN_S
from uasfly.drivers.live_eyes import open_eyes
from uasfly.drivers.sight import Sight
from uasfly.errors import FileError, UasflyError
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.messages import MarkerSample, OdometrySample, Sample, VehicleSample
from uasfly.record.writer import LogWriter
from uasfly.vision.frames import Announcement

_WAIT_S = 0.05
_TELL_EVERY_S = 0.5

Tell = Callable[[str, float], None]


class TelemetryLink(Protocol):
    """What is needed of a link, see `uasfly.link.protocol`."""

    def poll(self) -> tuple[Sample, ...]:
        """Samples that have arrived."""
        ...

    def wait_for_motion(self, timeout_s: float) -> Coroutine[Any, Any, bool]:
        """Wait for the next odometry."""
        ...


class Watcher(Protocol):
    """What is needed of `LiveEyes`."""

    def look(self) -> tuple[MarkerSample, ...]:
        """Sightings since the last call."""
        ...

    def take_announcements(self) -> list[Announcement]:
        """What troubles camera and detection."""
        ...


@dataclass(slots=True)
class Recorded:
    """What a recording holds."""

    odometry: int = 0
    sightings: int = 0


def record_hand_held(
    url: str, sight: Sight, log: Path, duration_s: float, tell: Tell, system_id: int | None = None
) -> Recorded:
    """Connect and record; Ctrl-C ends the recording early.

    Args:
        url: of the vehicle.
        sight: camera with its source, and bundles.
        log: file to be written; it must not be there.
        duration_s: of the recording.
        tell: called twice a second with what there is so far and the share of the time that is over.
        system_id: the vehicle's MAVLink system, None for the only one heard.

    Raises:
        UasflyError: the log is there already, no vehicle, or it is armed.
    """
    if log.exists():
        raise FileError(str(log), ["this log is there already; name another file, or leave --connect out to read it"])
    return asyncio.run(_record(url, sight, log, duration_s, tell, system_id))


async def _record(url: str, sight: Sight, log: Path, duration_s: float, tell: Tell, system_id: int | None) -> Recorded:
    link = await MavsdkLink.connect(url, system_id=system_id, timeout_s=CONNECT_TIMEOUT_S, listen_s=LISTEN_S)
    try:
        with open_eyes(sight, "") as eyes:
            assert eyes is not None
            writer = LogWriter(log, {"sight": sight.description(), "hand_held": True})
            try:
                recorded = await collect(link, eyes, writer, duration_s, tell)
            finally:
                writer.close()
            if writer.problem:
                raise FileError(str(log), [writer.problem])
            return recorded
    finally:
        await link.close()


async def collect(
    link: TelemetryLink,
    eyes: Watcher,
    writer: LogWriter,
    duration_s: float,
    tell: Tell,
    clock: Callable[[], float] = time.monotonic,
) -> Recorded:
    """Write what arrives until the time is over or somebody interrupts.

    Raises:
        UasflyError: the vehicle is armed.
    """
    recorded, started = Recorded(), clock()
    trouble, told_s = "", started
    try:
        while (now := clock()) - started < duration_s:
            for sample in (*link.poll(), *eyes.look()):
                if isinstance(sample, VehicleSample) and sample.armed:
                    raise UasflyError(
                        "expected a vehicle that is disarmed and carried by hand, found it armed; disarm it"
                    )
                recorded.odometry += isinstance(sample, OdometrySample)
                recorded.sightings += isinstance(sample, MarkerSample)
                writer.write(sample, now)
            for _, text in eyes.take_announcements():
                trouble = f" ({text})"
            if now - told_s >= _TELL_EVERY_S:
                told_s = now
                tell(f"{recorded.sightings} sightings{trouble}", (now - started) / duration_s)
            await link.wait_for_motion(_WAIT_S)
    except asyncio.CancelledError:  # Ctrl-C: what there is counts
        task = asyncio.current_task()
        if task is not None:
            task.uncancel()
    return recorded
