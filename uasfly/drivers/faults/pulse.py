"""Tells whether this machine had time for a flight in real time: a beat that comes late was held up."""

from __future__ import annotations

import threading
import time

BEAT_S = 0.02


class Pulse(threading.Thread):
    """Beats while a flight lasts, as a context manager.

    Attributes:
        latest_s: by how much the latest beat was late.
    """

    def __init__(self) -> None:
        super().__init__(name="pulse", daemon=True)
        self.latest_s = 0.0
        self._ended = threading.Event()

    def run(self) -> None:
        """Beat until the end."""
        due_s = time.monotonic() + BEAT_S
        while not self._ended.wait(max(0.0, due_s - time.monotonic())):
            now = time.monotonic()
            self.latest_s = max(self.latest_s, now - due_s)
            due_s = now + BEAT_S

    def __enter__(self) -> Pulse:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join()
