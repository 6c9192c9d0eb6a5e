"""What waits to be polled: its order, and what is told twice."""

from __future__ import annotations

import json
import logging

import pytest

from tests.link.test_decoder import heartbeat, odometry
from uasfly.link.clock import ClockMap
from uasfly.link.inbox import TRUTH_MESSAGES, Inbox
from uasfly.messages import LinkEvent, LinkSample, OdometrySample, TextSample, VehicleSample


class Listening:
    """An inbox that is not synchronised, what it has been heard to say, and how often it has called."""

    def __init__(self, want_truth: bool = False) -> None:
        self.heard: list[str] = []
        self.calls = 0
        self.inbox = Inbox(ClockMap(), want_truth, lambda sample: self.heard.append(sample.text), self._count)

    def _count(self) -> None:
        self.calls += 1


def test_samples_come_in_the_order_of_their_arrival_and_texts_after_them() -> None:
    """Across all types of message; then the vehicle's texts, each once, and last what the link itself says."""
    listening = Listening()
    inbox, slots = listening.inbox, listening.inbox.slots
    inbox.say(4, "no heartbeat")
    inbox.add(LinkSample(9.0, LinkEvent.REBOOTED))
    slots["STATUSTEXT"].put(1.0, json.dumps({"severity": 6, "text": "Armed"}))
    slots["STATUSTEXT"].put(1.1, json.dumps({"severity": 6, "text": "Takeoff detected"}))
    inbox.events.add(1.2, 6, "Armed")
    slots["HEARTBEAT"].put(1.3, heartbeat(4, 3))
    slots["ODOMETRY"].put(1.25, json.dumps(odometry()))
    slots["ODOMETRY"].put(1.35, json.dumps(odometry()))
    samples = inbox.take()
    kinds = [OdometrySample, VehicleSample, OdometrySample, TextSample, TextSample, TextSample, LinkSample]
    assert [type(sample) for sample in samples] == kinds
    assert [sample.time_s for sample in samples[:3]] == [1.25, 1.3, 1.35]
    said = [sample.text for sample in samples if isinstance(sample, TextSample)]
    assert said == ["Armed", "Takeoff detected", "no heartbeat"]
    assert listening.heard == ["Armed", "Takeoff detected"]
    assert inbox.heartbeat_s == 1.3
    assert inbox.take() == []


def test_an_inbox_knows_whether_something_waits(caplog: pytest.LogCaptureFixture) -> None:
    """A message, an event, or words of the link, which call for somebody and stay below a warning in the log."""
    listening = Listening()
    inbox = listening.inbox
    assert not inbox
    inbox.slots["ODOMETRY"].put(1.0, "{")
    assert inbox
    assert inbox.take() == []  # no sample can be made of it
    assert inbox.dropped == {"ODOMETRY": 1}
    assert not inbox
    inbox.events.add(1.0, 6, "Armed")
    assert inbox
    inbox.take()
    assert (bool(inbox), listening.calls) == (False, 0)
    with caplog.at_level(logging.DEBUG, "uasfly.link"):
        inbox.say(4, "no heartbeat")
    assert (bool(inbox), listening.calls) == (True, 1)
    assert [record.levelno for record in caplog.records] == [logging.INFO]


def test_the_true_state_has_slots_only_where_it_is_wanted() -> None:
    """A real vehicle's debug arrays are not decoded."""
    assert not Listening().inbox.slots.keys() & TRUTH_MESSAGES
    assert Listening(want_truth=True).inbox.slots.keys() >= TRUTH_MESSAGES
