"""The live view of a flight: on a terminal a picture that is redrawn four times a second, without one plain lines.

`update` may be called from another thread than the rest.
"""

from __future__ import annotations

import contextlib
import math
import time
import types
from collections.abc import Callable

from rich.console import Console
from rich.live import Live

from uasfly.cli.capture import Capture
from uasfly.cli.dashboard import Dashboard
from uasfly.cli.readings import error_m, wind_in_words
from uasfly.cli.scene import Recent
from uasfly.drivers.plan import FlightPlan
from uasfly.drivers.watching import Cycle
from uasfly.messages import Status

REDRAW_S = 0.25
PLAIN_LINE_S = 5.0


class LiveView:
    """Shows each step's status.

    The terminal's other screen is used, so that what was on it before is there again after the flight.
    """

    def __init__(
        self,
        mission: str,
        airframe: str,
        console: Console | None = None,
        *,
        capture: Capture | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare for a mission and airframe.

        Args:
            mission: its name, until `plan` tells more.
            airframe: its name.
            console: stderr unless a test hands one in.
            capture: takes a picture of the flight, where one is wanted.
            clock: decides when to redraw.
        """
        self._console = console or Console(stderr=True)
        self._recent = Recent(f"uasfly · {mission} · {airframe}")
        # What others print is left alone: taken over by Rich, it would draw in the thread of whoever prints.
        self._live = Live(
            console=self._console, screen=True, auto_refresh=False, redirect_stdout=False, redirect_stderr=False
        )
        self._draws = self._console.is_terminal and not self._console.is_dumb_terminal
        self._capture = capture
        self._clock = clock
        self._next_s = -math.inf
        self._closed = False

    def __enter__(self) -> LiveView:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._closed = True
        with contextlib.suppress(OSError):  # the terminal may be gone; the flight's result is not
            self._live.stop()

    def plan(self, plan: FlightPlan) -> None:
        """Learn what is to be flown."""
        self._recent.plan(plan)

    def say(self, text: str) -> None:
        """One line that is not part of a step (connecting, waiting)."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def update(self, status: Status, cycle: Cycle) -> None:
        """Take in one step; draws only when it is time to."""
        self._recent.take(status, cycle)
        if self._capture is not None:
            self._capture.look(self._recent)
        if self._draws:
            self._redraw()
        else:
            self._print(status)

    def _redraw(self) -> None:
        """Draw when a pause after the last drawing is over: however slow a terminal is, it never shows old steps."""
        if self._closed or self._clock() < self._next_s:
            return
        scene = self._recent.scene()
        assert scene is not None  # a step has been taken in
        self._live.start()
        self._live.update(Dashboard(scene), refresh=True)
        self._next_s = self._clock() + REDRAW_S

    def _print(self, status: Status) -> None:
        for _, text in status.announcements:
            self.say(f"{_stamp(status.time_s)} {text}")
        if status.time_s >= self._next_s:
            self._next_s = status.time_s + PLAIN_LINE_S
            self.say(_plain_line(status))


def _stamp(time_s: float) -> str:
    return f"[{time_s:10.2f}]"


def _plain_line(status: Status) -> str:
    parts = [_stamp(status.time_s), status.phase.value, f"{status.progress * 100:.0f} %"]
    estimate = status.estimate
    if estimate is not None:
        x, y, z = estimate.position_in_world.tolist()
        parts.append(f"at {x:+.2f} {y:+.2f} {z:+.2f} m")
        if status.reference_position_in_world is not None:
            parts.append(f"error {error_m(status) * 100:.1f} cm")
        fx, fy, fz = estimate.force_in_world.tolist()
        parts.append(f"force {fx:+.2f} {fy:+.2f} {fz:+.2f} m/s²")
        parts.append(f"wind {wind_in_words(status.wind)}")
    return "  ".join(parts)
