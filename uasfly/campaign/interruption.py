"""Ctrl-C that cannot get lost."""

from __future__ import annotations

import signal
import threading
import types
from typing import Any


class Interruption:
    """Remembers Ctrl-C (and SIGTERM) while it is entered, beside raising KeyboardInterrupt at once.

    A flight goes through CasADi and through destructors, and both may swallow the exception: the flight would then go
    on, perhaps with one solve that was broken off, and nobody would stop.
    """

    def __init__(self) -> None:
        """Nothing has happened yet."""
        self._wanted = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) is not signal.SIG_IGN:  # as for jobs in the background
                    self._before[number] = signal.signal(number, self._take)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raise KeyboardInterrupt where one has been asked for; what was just flown must not be used then."""
        if self._wanted:
            raise KeyboardInterrupt

    def _take(self, number: int, frame: types.FrameType | None) -> None:
        del number, frame
        self._wanted = True
        raise KeyboardInterrupt
