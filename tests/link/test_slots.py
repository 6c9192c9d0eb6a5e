"""Slots and wake-ups between two threads; events and their echoes."""

from __future__ import annotations

import asyncio
import threading

import pytest

from uasfly.link.events import EchoFilter, EventFeed
from uasfly.link.slots import Slot, WakeUp
from uasfly.messages import TextSample


def test_a_slot_keeps_the_newest_and_counts_the_rest() -> None:
    """Beyond its size the oldest messages go; what is taken comes oldest first and only once."""
    slot = Slot("ODOMETRY", 3)
    for index in range(5):
        slot.put(float(index), str(index))
    assert slot.waiting
    assert slot.take() == [(2.0, "2"), (3.0, "3"), (4.0, "4")]
    assert not slot.waiting
    assert slot.take() == []
    assert (slot.received, slot.overrun) == (5, 2)


def test_a_rate_falls_while_nothing_comes() -> None:
    """100 Hz while they come, less with every second of silence, 0 before the second message."""
    slot = Slot("ODOMETRY", 3)
    assert slot.rate_hz(0.0) == 0.0
    for index in range(100):
        slot.put(index * 0.01, "")
    assert slot.rate_hz(0.99) == pytest.approx(100.0)
    assert slot.rate_hz(1.99) == pytest.approx(63.0 / 1.63)


async def test_wake_ups_from_another_thread_are_coalesced() -> None:
    """However often the bell rings before the loop comes to it, it is heard once, and again after that."""
    heard = asyncio.Event()
    calls = 0

    def on_wake() -> None:
        nonlocal calls
        calls += 1
        heard.set()

    wake_up = WakeUp(asyncio.get_running_loop(), on_wake)

    def ring_often() -> None:
        for _ in range(1000):
            wake_up.ring()

    for round_number in (1, 2):
        thread = threading.Thread(target=ring_often)
        thread.start()
        thread.join()
        await asyncio.wait_for(heard.wait(), 10.0)
        heard.clear()
        assert calls == round_number


def test_ringing_after_the_end_of_the_loop_is_no_error() -> None:
    """MAVSDK's thread may still be in a callback then."""
    loop = asyncio.new_event_loop()
    wake_up = WakeUp(loop, lambda: None)
    loop.close()
    wake_up.ring()


def test_events_wait_in_order() -> None:
    """And the present arming problems are kept beside them."""
    feed = EventFeed()
    assert not feed
    feed.add(1.0, 2, "Arming denied")
    feed.add(1.1, 6, "Armed")
    feed.set_problems(("no GPS",))
    assert feed
    assert feed.take() == [TextSample(1.0, 2, "Arming denied"), TextSample(1.1, 6, "Armed")]
    assert feed.take() == []
    assert feed.problems == ("no GPS",)


def test_a_text_that_comes_twice_by_two_ways_is_passed_once() -> None:
    """As an event and as a status text within 2 s; repetitions by one way are repetitions."""
    echoes = EchoFilter()
    assert echoes.passes(TextSample(1.0, 4, "Takeoff detected"), "event")
    assert not echoes.passes(TextSample(1.1, 6, "Takeoff detected"), "STATUSTEXT")
    assert echoes.passes(TextSample(1.2, 6, "Takeoff detected"), "event")
    assert echoes.passes(TextSample(1.2, 6, "Landing detected"), "STATUSTEXT")
    assert echoes.passes(TextSample(4.0, 6, "Takeoff detected"), "STATUSTEXT")
