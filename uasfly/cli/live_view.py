"""The live view of a flight: phase, position and error, force, solve time, progress and the last warnings.

On a terminal it redraws four times a second; without one it prints plain lines. `update` may be called from another
thread than the rest.
"""

from __future__ import annotations

import contextlib
import math
import types
from collections import deque

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from uasfly.messages import Status

REDRAW_S = 0.25
PLAIN_LINE_S = 5.0
WARNINGS_SHOWN = 4
_ARROWS = "→↗↑↖←↙↓↘"


class LiveView:
    """Shows each step's status."""

    def __init__(self, mission: str, airframe: str, console: Console | None = None) -> None:
        """Prepare for a mission and airframe; `console` is stderr unless a test hands one in."""
        self._console = console or Console(stderr=True)
        self._title = escape(f"uasfly · {mission} · {airframe}")
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._rich = self._console.is_terminal
        self._last_s = -math.inf
        self._texts: deque[tuple[int, str]] = deque(maxlen=WARNINGS_SHOWN)

    def __enter__(self) -> LiveView:
        if self._rich:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        if self._rich:
            with contextlib.suppress(OSError):  # the terminal may be gone; the flight's result is not
                self._live.stop()

    def say(self, text: str) -> None:
        """One line that is not part of a step (connecting, waiting)."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def update(self, status: Status, solve_ms: float | None = None) -> None:
        """Take in one step; draws only when it is time to."""
        for severity, text in status.announcements:
            self._texts.append((severity, text))
            if not self._rich:
                self._console.print(f"{_clock(status.time_s)} {text}", highlight=False, markup=False, soft_wrap=True)
        period_s = REDRAW_S if self._rich else PLAIN_LINE_S
        if status.time_s - self._last_s < period_s:
            return
        self._last_s = status.time_s
        if self._rich:
            self._live.update(self.render(status, solve_ms), refresh=True)
        else:
            self._console.print(_plain_line(status), highlight=False, markup=False, soft_wrap=True)

    def render(self, status: Status, solve_ms: float | None) -> Panel:
        """The picture of one step."""
        grid = Table.grid(padding=(0, 2))
        grid.add_column(style="bold cyan", min_width=12)
        grid.add_column()
        leg = f", leg {status.leg + 1}" if status.leg >= 0 else ""
        grid.add_row("phase", Text(status.phase.value + leg, style="bold"))
        grid.add_row("progress", ProgressBar(total=1.0, completed=status.progress, width=40))
        estimate = status.estimate
        if estimate is not None:
            x, y, z = estimate.position_in_world.tolist()
            grid.add_row("position", f"east {x:+7.2f}  north {y:+7.2f}  up {z:+7.2f} m")
            sigma = float(estimate.position_sigma_m.max())
            grid.add_row("known to", Text(f"± {sigma * 100:.1f} cm", style="red" if sigma > 0.5 else "green"))
            if status.reference_position_in_world is not None:
                error = float(_length((estimate.position_in_world - status.reference_position_in_world).tolist()))
                colour = "green" if error < 0.1 else "yellow" if error < 0.3 else "red"
                grid.add_row("error", Text(f"{error * 100:5.1f} cm", style=f"bold {colour}"))
            grid.add_row("wind force", _force_text(estimate.force_in_world.tolist()))
        if solve_ms is not None:
            fallback = f"  fallback: {status.fallback}" if status.fallback else ""
            grid.add_row("solver", Text(f"{solve_ms:.2f} ms{fallback}", style="red" if fallback else ""))
        lines = [Text(text, style="red" if severity <= 3 else "yellow") for severity, text in self._texts]
        return Panel(Group(grid, *lines), title=self._title, width=78)


def _length(vector: list[float]) -> float:
    """Length of a vector given as a list."""
    return math.sqrt(math.fsum(v * v for v in vector))


def _force_text(force: list[float]) -> str:
    """Horizontal force as an arrow on a map (north up) and a number, vertical force as a number."""
    east, north, up = force
    size = math.hypot(east, north)
    arrow = _ARROWS[round(math.atan2(north, east) / (math.pi / 4.0)) % 8] if size > 0.05 else "·"
    return f"{arrow} {size:.2f} m/s²  up {up:+.2f} m/s²"


def _clock(time_s: float) -> str:
    return f"[{time_s:10.2f}]"


def _plain_line(status: Status) -> str:
    parts = [_clock(status.time_s), status.phase.value, f"{status.progress * 100:.0f} %"]
    estimate = status.estimate
    if estimate is not None:
        x, y, z = estimate.position_in_world.tolist()
        parts.append(f"at {x:+.2f} {y:+.2f} {z:+.2f} m")
        if status.reference_position_in_world is not None:
            error = _length((estimate.position_in_world - status.reference_position_in_world).tolist())
            parts.append(f"error {error * 100:.1f} cm")
        fx, fy, fz = estimate.force_in_world.tolist()
        parts.append(f"force {fx:+.2f} {fy:+.2f} {fz:+.2f} m/s²")
    return "  ".join(parts)
