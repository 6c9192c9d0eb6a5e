"""When a control cycle begins in real time: every period, right after motion has arrived."""

from __future__ import annotations

import asyncio
import time

from uasfly.link.protocol import LiveLink

WINDOW_S = 0.006  # a cycle waits for motion within so much of its beat, earlier or later
FOLLOW = 0.5  # of the way to where the motion came: the beat follows the vehicle's clock, not its jitter


class Metronome:
    """Beats once a period, and moves its beat to where the vehicle's motion samples arrive.

    PX4 sends them at twice the rate of the cycles. A beat that fell between two of them would let each setpoint answer
    to motion that is up to 10 ms old. Where none comes within the window the beat stays: silence slows nothing.

    Args:
        link: tells when motion arrives.
        period_s: of the cycles.
    """

    def __init__(self, link: LiveLink, period_s: float) -> None:
        self._link = link
        self._period_s = period_s
        self._window_s = min(WINDOW_S, 0.4 * period_s)
        self._beat_s = time.monotonic()

    async def next(self) -> None:
        """Wait until the next cycle is to begin; a beat that was missed is left out instead of made up for."""
        self._beat_s += self._period_s
        now = time.monotonic()
        if now > self._beat_s + self._period_s:
            self._beat_s = now
        await asyncio.sleep(max(0.0, self._beat_s - self._window_s - now))
        left_s = self._beat_s + self._window_s - time.monotonic()
        if left_s > 0.0 and await self._link.wait_for_motion(left_s):
            self._beat_s += FOLLOW * (time.monotonic() - self._beat_s)
