"""Waiting in the event loop for what another thread brings."""

from __future__ import annotations

import asyncio

from uasfly.link.waiting import Waiting

PATIENCE_S = 10.0


class Desk:
    """Something to wait for, and how often it has been served; made inside an event loop."""

    def __init__(self) -> None:
        self.fresh = asyncio.Event()
        self.full = False
        self.served = 0
        self.waiting = Waiting(self.fresh, self._serve, lambda: self.full)

    def _serve(self) -> None:
        self.served += 1


async def turns() -> None:
    """Let everything run that has been queued."""
    for _ in range(5):
        await asyncio.sleep(0.0)


async def test_the_loop_is_woken_only_where_somebody_waits() -> None:
    """Arrivals that nobody waits for, motion among them, cost it nothing; a plain ring is always heard."""
    desk = Desk()
    desk.waiting.ring_if_awaited()
    desk.waiting.ring_for_motion()
    await turns()
    assert desk.served == 0
    desk.waiting.ring()
    await turns()
    assert desk.served == 1


async def test_a_wait_ends_with_something_new_and_not_with_a_mere_ring() -> None:
    """What has rung may be nothing to poll; motion that no cycle waits for is something new as well."""
    desk = Desk()
    waiter = asyncio.create_task(desk.waiting.wait(PATIENCE_S))
    await turns()
    desk.waiting.ring_if_awaited()
    await turns()
    assert desk.served == 1
    assert not waiter.done()
    desk.full = True
    desk.waiting.ring_for_motion()
    await turns()
    assert waiter.done()


async def test_a_wait_ends_at_once_where_something_waits_already() -> None:
    """And after its time-out where nothing comes, without an error."""
    desk = Desk()
    await desk.waiting.wait(0.01)
    desk.full = True
    waiter = asyncio.create_task(desk.waiting.wait(PATIENCE_S))
    await turns()
    assert waiter.done()


async def test_a_wait_for_motion_ends_with_motion_alone() -> None:
    """Other messages wake the loop without ending it; the next wait is for the next motion."""
    desk = Desk()
    waiter = asyncio.create_task(desk.waiting.wait_for_motion(PATIENCE_S))
    await turns()
    desk.waiting.ring()
    await turns()
    assert not waiter.done()
    desk.waiting.ring_for_motion()
    await turns()
    assert waiter.done()
    assert waiter.result()
    assert not await desk.waiting.wait_for_motion(0.01)


async def test_closing_ends_a_wait_and_nothing_is_served_after_it() -> None:
    """A thread that still rings does no harm, and later waits end at once."""
    desk = Desk()
    waiter = asyncio.create_task(desk.waiting.wait(PATIENCE_S))
    await turns()
    desk.waiting.close()
    desk.waiting.ring()
    await turns()
    assert waiter.done()
    assert desk.served == 0
    later = asyncio.create_task(desk.waiting.wait(PATIENCE_S))
    await turns()
    assert later.done()
