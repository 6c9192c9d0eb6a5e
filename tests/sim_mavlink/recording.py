"""The recording of PX4 that the server is held to (see tests/data.py for where it comes from)."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

from tests.data import test_data
from uasfly.sim.mavlink.framing import FrameReader

Message = Any
_OVERHEAD, _SIGNATURE = 12, 13


@dataclass(frozen=True)
class Events:
    """What was done to PX4 and what it answered, by seconds since the recording began (`t_s`)."""

    lines: list[dict[str, Any]]

    def phase(self, name: str) -> tuple[float, float]:
        """Beginning and end of a phase."""
        phases = [event for event in self.lines if event["event"] == "phase"]
        index = [event["name"] for event in phases].index(name)
        return phases[index]["t_s"], phases[index + 1]["t_s"]


@dataclass(frozen=True)
class Recording:
    """What PX4 sent, with the time of its arrival on the clock of the events."""

    events: Events
    messages: list[tuple[float, Message]]
    unreadable: set[int]  # numbers of messages that pymavlink does not know

    def during(self, name: str) -> list[Message]:
        """Messages of a phase."""
        begin, end = self.events.phase(name)
        return [message for time_s, message in self.messages if begin <= time_s < end]


def conformance_events() -> Events:
    """Events of the recording "conformance"; skips where there is none."""
    lines = test_data("px4_recordings/conformance.jsonl").read_text().splitlines()
    return Events([json.loads(line) for line in lines])


def conformance(until_s: float) -> Recording:
    """The beginning of the recording "conformance"; skips where there is none."""
    raw = test_data("px4_recordings/conformance.tlog").read_bytes()
    events = conformance_events()
    began = events.lines[0]["unix_s"] - events.lines[0]["t_s"]
    messages, unreadable, reader, at = [], set[int](), FrameReader(), 0
    while at < len(raw):
        time_s = struct.unpack_from(">Q", raw, at)[0] * 1e-6 - began
        if time_s > until_s:
            break
        size = raw[at + 9] + _OVERHEAD + (_SIGNATURE if raw[at + 10] & 1 else 0)
        frame = raw[at + 8 : at + 8 + size]
        read = list(reader.messages(frame))
        messages += [(time_s, message) for message in read]
        if not read:
            unreadable.add(int.from_bytes(frame[7:10], "little"))
        at += 8 + size
    return Recording(events, messages, unreadable)
