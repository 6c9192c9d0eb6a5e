"""What PX4 was asked and what it sent, on its own clock (see tests/data.py for where the recording comes from)."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from tests.data import test_data
from uasfly.messages import Array
from uasfly.sim.mavlink.framing import FrameReader

Message = Any
_STAMP, _OVERHEAD, _SIGNATURE = 8, 12, 13
_IDLE = "default streams, idle"
# Decoding is what takes time: after the idle phase only these are read, of the others the number alone.
_READ_TO_THE_END = frozenset(
    {
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_SYS_STATUS,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_PARAM_ERROR,
        dialect.MAVLINK_MSG_ID_ATTITUDE,
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET,
        dialect.MAVLINK_MSG_ID_COMMAND_ACK,
        dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
        dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    }
)


@dataclass(frozen=True)
class Received:
    """One message: when it came, its number, and its content where it was read.

    Attributes:
        time_s: on the vehicle's clock, since boot.
        number: MAVLink's number of the message.
        message: None where the content was not read.
    """

    time_s: float
    number: int
    message: Message


@dataclass(frozen=True)
class Event:
    """Something that was done to PX4, or its answer.

    Attributes:
        time_s: on the vehicle's clock, since boot.
        kind: "phase", "command", "ack", "param_read", "param_set", "mode" and others.
        values: the fields of the line.
    """

    time_s: float
    kind: str
    values: dict[str, Any]


@dataclass(frozen=True)
class Recording:
    """What was done to PX4 and everything that it sent.

    Both are on the vehicle's clock: PX4's simulator ran up to 3 % slower than the clock that stamped them.

    Attributes:
        events: in their order.
        received: in its order.
        unreadable: numbers of messages that pymavlink does not know.
    """

    events: list[Event]
    received: list[Received]
    unreadable: set[int]

    def phase(self, name: str) -> tuple[float, float]:
        """Beginning and end of a phase [s]."""
        phases = [event for event in self.events if event.kind in ("phase", "end")]
        index = [event.values.get("name") for event in phases].index(name)
        return phases[index].time_s, phases[index + 1].time_s

    def during(self, name: str) -> list[Received]:
        """What came in a phase."""
        begin, end = self.phase(name)
        return [one for one in self.received if begin <= one.time_s < end]

    def of_kind(self, kind: str) -> list[Event]:
        """Events of a kind."""
        return [event for event in self.events if event.kind == kind]


def conformance() -> Recording:
    """The recording "conformance"; skips where there is none."""
    raw = test_data("px4_recordings/conformance.tlog").read_bytes()
    lines = [json.loads(line) for line in test_data("px4_recordings/conformance.jsonl").read_text().splitlines()]
    began_s = lines[0]["unix_s"] - lines[0]["t_s"]
    begin_s, end_s = (next(line["t_s"] for line in lines if line.get("name") == name) for name in (_IDLE, "parameters"))
    arrived, unreadable = [], set[int]()
    for arrival_s, number, frame in _frames(raw, began_s):
        whole = number in _READ_TO_THE_END or begin_s <= arrival_s < end_s
        content = next(FrameReader().messages(frame), None) if whole else None
        if number not in dialect.mavlink_map:
            unreadable.add(number)
        arrived.append(Received(arrival_s, number, content))
    clock = _clock(arrived)
    times = np.interp([one.time_s for one in arrived], *clock.T)
    received = [Received(float(time_s), one.number, one.message) for time_s, one in zip(times, arrived, strict=True)]
    events = [Event(float(np.interp(line["t_s"], *clock.T)), line["event"], line) for line in lines]
    return Recording(events, received, unreadable)


def contents(received: Iterable[Received], name: str) -> list[Message]:
    """What messages of one name say."""
    return [one.message for one in received if one.message is not None and one.message.get_type() == name]


def _clock(arrived: list[Received]) -> Array:
    """Arrival and vehicle time [s] of every ATTITUDE, (n, 2)."""
    stamps = [(one.time_s, one.message.time_boot_ms * 1e-3) for one in arrived if one.number == 30]
    return np.array(stamps)


def _frames(raw: bytes, began_s: float) -> Iterator[tuple[float, int, bytes]]:
    """Seconds since the recording began, message number and frame."""
    at = 0
    while at < len(raw):
        arrival_s = struct.unpack_from(">Q", raw, at)[0] * 1e-6 - began_s
        start = at + _STAMP
        size = raw[start + 1] + _OVERHEAD + (_SIGNATURE if raw[start + 2] & 1 else 0)
        yield arrival_s, int.from_bytes(raw[start + 7 : start + 10], "little"), raw[start : start + size]
        at = start + size
