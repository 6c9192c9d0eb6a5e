"""Waiting for what MAVSDK's thread brings: the event loop is woken only where somebody waits for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from uasfly.link.slots import WakeUp


class Waiting:
    """Lets the event loop wait for something new, or for the next motion.

    MAVSDK's thread calls the methods that ring, and nothing else of it.

    Args:
        fresh: set when there is something new; others may set it too.
        serve: handles what does not wait to be polled, each time the loop has been woken.
        something_waits: whether there is something new.

    Attributes:
        ring: for MAVSDK's thread; wakes the loop in any case.
    """

    def __init__(self, fresh: asyncio.Event, serve: Callable[[], None], something_waits: Callable[[], bool]) -> None:
        self._fresh = fresh
        self._serve = serve
        self._something_waits = something_waits
        self._closed = False
        self._awaited = False
        self._motion: asyncio.Future[bool] | None = None  # waits for the next ODOMETRY
        self._motion_came = False
        self.ring = WakeUp(asyncio.get_running_loop(), self._on_wake).ring

    def ring_if_awaited(self) -> None:
        """From MAVSDK's thread: 200 wake-ups a second would cost more than all decoding."""
        if self._awaited:
            self.ring()

    def ring_for_motion(self) -> None:
        """From MAVSDK's thread: a control cycle waits for this one."""
        if self._motion is not None:
            self._motion_came = True
            self.ring()
        else:
            self.ring_if_awaited()

    async def wait(self, timeout_s: float) -> None:
        """Wait until something new is there, or until the time-out [s]; not at all once closed."""
        self._fresh.clear()
        self._awaited = True  # before the look, so that what arrives after it rings
        try:
            if self._closed or self._something_waits():
                await asyncio.sleep(0.0)
                return
            async with asyncio.timeout(timeout_s):
                await self._fresh.wait()
        except TimeoutError:
            pass
        finally:
            self._awaited = False

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Wait until the next ODOMETRY arrives, at most so long [s]; whether one has."""
        loop = asyncio.get_running_loop()
        self._motion_came = False
        motion: asyncio.Future[bool] = loop.create_future()
        self._motion = motion
        timer = loop.call_later(timeout_s, _settle, motion, False)
        try:
            return await motion
        finally:
            timer.cancel()
            self._motion = None

    def close(self) -> None:
        """End a `wait` under way; nothing is served from here on."""
        self._closed = True
        self._fresh.set()

    def _on_wake(self) -> None:
        if self._motion is not None and self._motion_came:
            _settle(self._motion, True)
        if not self._closed:
            self._serve()
            if self._something_waits():
                self._fresh.set()


def _settle(answer: asyncio.Future[bool], came: bool) -> None:
    if not answer.done():
        answer.set_result(came)
