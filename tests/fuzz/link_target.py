"""Messages of a vehicle into the link: the JSON that MAVSDK delivers, with odd values, through slots and `poll`."""

from __future__ import annotations

import asyncio
import base64
import json
import math
import time
from collections.abc import Callable
from typing import Any
from unittest import mock

import numpy as np

from tests.fuzz import frames
from tests.fuzz.harness import FindingError, Rng
from tests.fuzz.odd import choice, odd_data
from uasfly.link.bridge import HeardSystem
from uasfly.link.events import EventFeed
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.slots import Slot
from uasfly.link.urls import parse_url
from uasfly.messages import Request, RequestKind, Sample, Setpoint, TextSample

HUGE = (10**20, -(10**20), 10**400, 2**63, -1, 1e300, -1e300, 1e39)
TEXTS = (
    "null",
    "[]",
    "{}",
    "3",
    '"x"',
    "",
    "{",
    "NaN",
    '{"x": 1e400}',
    "[" * 300,
    "\ud800",
    "{" + '"a":1,' * 500 + "}",
)
PARAMETER_NAMES = ("MIS_TAKEOFF_ALT", "COM_OF_LOSS_T", "x" * 16, "", "é")


class FakeBridge:
    """A bridge whose other end is the test; what is sent must be JSON without a number that is none."""

    def __init__(self) -> None:
        self.system_id = 1
        self.send_errors = 0
        self.attached = True
        self.slots: dict[str, tuple[Slot, Callable[[], None]]] = {}
        self.sent: list[tuple[str, dict[str, Any]]] = []
        self.feed: EventFeed | None = None

    def subscribe(self, slot: Slot, ring: Callable[[], None]) -> None:
        """Remember a slot."""
        self.slots[slot.name] = (slot, ring)

    def subscribe_events(self, feed: EventFeed, ring: Callable[[], None]) -> None:
        """Remember the feed."""
        self.feed = feed

    def send(self, name: str, fields: str) -> bool:
        """Take a message."""
        self.sent.append((name, json.loads(fields, parse_constant=_refuse)))
        return True

    def heard(self) -> list[HeardSystem]:
        """Nobody."""
        return []

    def close(self) -> None:
        """Nothing to do."""


class HostClock:
    """A clock of the host that only the session moves, so that an input can be repeated."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __enter__(self) -> None:
        self._patches: list[mock._patch[Callable[[], float]]] = [
            mock.patch("time.monotonic", lambda: self.now_s),
            mock.patch("time.monotonic_ns", lambda: round(self.now_s * 1e9)),
        ]
        for patch in self._patches:
            patch.start()

    def __exit__(self, *_: object) -> None:
        for patch in self._patches:
            patch.stop()


class LinkSession:
    """A link with requests, parameters and home under way, in an event loop of its own."""

    def __init__(self, rng: Rng) -> None:
        self._clock = HostClock()
        self._loop = asyncio.new_event_loop()
        self._problems: list[str] = []
        self._loop.set_exception_handler(lambda _, context: self._problems.append(repr(context)))
        self._bridge = FakeBridge()
        self._tasks: set[asyncio.Task[Any]] = set()
        with self._clock:
            self._link = self._loop.run_until_complete(self._open(bool(rng.integers(2))))

    def feed(self, rng: Rng) -> bool:
        """A message, and now and then another thing that a flight does with its link."""
        with self._clock:
            self._clock.now_s += float(choice(rng, (0.0, 0.001, 0.01, 0.01, 0.02, 0.3, 2.0)))
            return self._loop.run_until_complete(self._turn(rng))

    def close(self) -> None:
        """Close the link; nothing may have gone wrong on the way."""
        with self._clock:
            self._loop.run_until_complete(self._close())
        self._loop.close()
        if self._problems:
            raise FindingError("; ".join(self._problems))

    async def _open(self, want_truth: bool) -> MavsdkLink:
        link = MavsdkLink(self._bridge, parse_url("udpin://127.0.0.1:14540"), want_truth)  # type: ignore[arg-type]
        link._upkeep.start()
        await asyncio.sleep(0.0)
        return link

    async def _close(self) -> None:
        for task in self._tasks:
            task.cancel()
        results = await asyncio.gather(*self._tasks, return_exceptions=True)
        self._problems += [repr(r) for r in results if isinstance(r, Exception)]
        await self._link.close()

    async def _turn(self, rng: Rng) -> bool:
        slot, ring = self._bridge.slots[choice(rng, tuple(self._bridge.slots))]
        slot.put(time.monotonic(), self._text(rng, slot.name))
        if self._bridge.feed is not None and rng.random() < 0.05:
            self._bridge.feed.add(
                time.monotonic(), int(rng.integers(-5, 300)), choice(rng, ("x", "\x1b", "é" * 500, ""))
            )
        ring()
        if rng.random() < 0.05:
            self._begin_something(rng)
        await asyncio.sleep(0.0)
        dropped = self._link._inbox.dropped.total()
        for sample in self._link.poll():
            check_sample(sample)
        now_s = time.monotonic()
        self._link.send(Setpoint(now_s, 0.1, -0.1, 1.0, 0.0, 0.5))
        name, sent = self._bridge.sent[-1]
        if name == "SET_ATTITUDE_TARGET" and not np.isfinite((*sent["q"], sent["thrust"], sent["time_boot_ms"])).all():
            raise FindingError(f"a setpoint went out as {sent}")
        if not all(map(math.isfinite, self._link.message_rates().values())):
            raise FindingError("a rate is no number")
        self._link.losses()
        if self._problems:
            raise FindingError("; ".join(self._problems))
        return self._link._inbox.dropped.total() == dropped

    def _begin_something(self, rng: Rng) -> None:
        kind = rng.integers(3)
        if kind == 0:
            self._link.request(Request(choice(rng, list(RequestKind)), 2.0))
            return
        work = self._link.home() if kind == 1 else self._link.read_parameters(PARAMETER_NAMES)
        self._tasks.add(self._loop.create_task(work))

    def _text(self, rng: Rng, name: str) -> str:
        if rng.random() < 0.05:
            return choice(rng, TEXTS)
        fields = plausible(rng, name, self._bridge.sent)
        for _ in range(int(rng.integers(3))):
            key = choice(rng, tuple(fields))
            kind = rng.integers(7)
            if kind == 0:
                del fields[key]
                if not fields:
                    break
            elif kind == 1:
                fields[key] = None
            elif kind == 2:
                fields[key] = choice(rng, HUGE)
            elif kind == 3:
                fields[key] = odd_data(rng)
            elif isinstance(fields[key], list):
                fields[key] = fields[key][: int(rng.integers(len(fields[key]) + 1))] if kind == 4 else [None] * 3
            else:
                fields[key] = [fields[key]]
        return json.dumps(fields)


def plausible(rng: Rng, name: str, sent: list[tuple[str, dict[str, Any]]]) -> dict[str, Any]:
    """Fields of a message as mavlink_direct delivers them, random but within what the wire carries, often answers."""
    if name == "ESC_STATUS":  # unknown to pymavlink
        rpm = rng.integers(-(2**31), 2**31, 4) if rng.random() < 0.2 else rng.integers(4000, 6000, 4)
        time_us = int(rng.integers(2**63)) if rng.random() < 0.2 else 10**6
        return {"index": 4 * int(rng.integers(2)), "time_usec": time_us, "rpm": rpm.tolist()}
    message = frames.CLASSES[name]
    fields = {key: _as_json(value) for key, value in frames.odd_fields(rng, message).items()}
    for key in ("q", "attitude_quaternion"):
        if key in fields and rng.random() < 0.8:
            q = rng.normal(size=4)
            fields[key] = (q / np.linalg.norm(q)).tolist()
    if name == "ODOMETRY" and rng.random() < 0.8:
        fields["frame_id"] = 1
    if name == "DEBUG_FLOAT_ARRAY" and rng.random() < 0.8:
        fields["name"] = "truth"
        fields["data"][6:10] = [1.0, 0.0, 0.0, 0.0]
    if name == "TIMESYNC" and rng.random() < 0.8:
        asked = [sent_fields["ts1"] for sent_name, sent_fields in sent[-60:] if sent_name == "TIMESYNC"]
        fields["ts1"] = choice(rng, asked) if asked else 0
        fields["tc1"] = choice(rng, (int(rng.integers(2**62)), time.monotonic_ns(), time.monotonic_ns() + 10**12, 1))
    if name == "COMMAND_ACK" and rng.random() < 0.8:
        asked = [sent_fields["command"] for sent_name, sent_fields in sent[-60:] if sent_name == "COMMAND_LONG"]
        fields |= {"command": choice(rng, asked) if asked else 512, "target_system": 1, "target_component": 195}
    if name == "PARAM_VALUE" and rng.random() < 0.8:
        fields["param_id"] = choice(rng, PARAMETER_NAMES)
    return fields


def _as_json(value: Any) -> Any:
    if isinstance(value, list):
        return [_as_json(item) for item in value]
    if isinstance(value, bytes):
        return value.decode(errors="replace") if len(value) < 40 else base64.b64encode(value).decode()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def check_sample(sample: Sample) -> None:
    """Whether a sample of the link has a time and is finite."""
    if isinstance(sample, TextSample) and not sample.text.isprintable():
        raise FindingError(f"a text that cannot be printed: {sample}")
    if not math.isfinite(sample.time_s) or sample.time_s > time.monotonic() + 1e-6:
        raise FindingError(f"a sample of no time that has been: {sample}")
    for name in (
        "position_in_world",
        "velocity_in_world",
        "quaternion_body_to_world",
        "angular_rate_in_body",
        "speeds_rad_s",
    ):
        values = getattr(sample, name, None)
        if values is not None and not (values.dtype == np.float64 and np.isfinite(values).all()):
            raise FindingError(f"{name} is not finite: {sample}")


def _refuse(constant: str) -> float:
    raise FindingError(f"{constant} was sent")
