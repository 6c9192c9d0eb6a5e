"""Between MAVSDK's callback thread and the event loop: bounded newest-wins slots and one coalesced wake-up."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable

RATE_WINDOW = 64


class Slot:
    """The newest messages of one type, filled by MAVSDK's thread and emptied by the event loop.

    Args:
        name: of the message.
        keep: how many of the newest messages wait; beyond that the oldest go (`overrun` counts them).

    Attributes:
        waiting: messages that nobody has taken yet, oldest first, as (arrival on the host's monotonic clock [s], JSON).
    """

    __slots__ = ("_stamps", "name", "overrun", "received", "waiting")

    def __init__(self, name: str, keep: int) -> None:
        self.name = name
        self.received = 0
        self.overrun = 0
        self.waiting: deque[tuple[float, str]] = deque(maxlen=keep)
        self._stamps: deque[float] = deque(maxlen=RATE_WINDOW)

    def put(self, arrival_s: float, text: str) -> None:
        """Add a message: appending to a bounded deque is atomic, so no lock is held in the callback."""
        if len(self.waiting) == self.waiting.maxlen:
            self.overrun += 1
        self.waiting.append((arrival_s, text))
        self._stamps.append(arrival_s)
        self.received += 1

    def take(self) -> list[tuple[float, str]]:
        """All waiting messages."""
        taken: list[tuple[float, str]] = []
        waiting = self.waiting
        while waiting:
            taken.append(waiting.popleft())
        return taken

    def rate_hz(self, now_s: float) -> float:
        """Rate over the last 64 messages; it falls while nothing comes."""
        count = len(self._stamps)
        if count < 2:
            return 0.0
        span_s = max(now_s, self._stamps[-1]) - self._stamps[0]
        return (count - 1) / span_s if span_s > 0.0 else 0.0


class WakeUp:
    """Calls a function in the event loop after one or many `ring`s of another thread; at most one call is queued."""

    def __init__(self, loop: asyncio.AbstractEventLoop, on_wake: Callable[[], None]) -> None:
        self._loop = loop
        self._on_wake = on_wake
        self._queued = False

    def ring(self) -> None:
        """From any thread; a closed loop is no error, because MAVSDK's thread may outlive it for a moment."""
        if self._queued:
            return
        self._queued = True
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._queued = False  # before the work: what arrives from here on rings again
        self._on_wake()
