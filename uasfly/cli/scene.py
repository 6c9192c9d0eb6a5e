"""What the live view has to draw from: the last step, and what has been seen of the flight lately."""

from __future__ import annotations

import math
import statistics
from collections import deque
from dataclasses import dataclass, replace

from uasfly.drivers.plan import FlightPlan
from uasfly.drivers.watching import Cycle
from uasfly.messages import Status

WINDOW_S = 2.0  # of the rates
SOLVES = 100  # of the median
NOTES = 30


@dataclass(frozen=True, slots=True)
class Note:
    """A text that was announced: when, counted from the first step, how severe (MAVLink), and how often in a row."""

    clock_s: float
    severity: int
    text: str
    times: int = 1


@dataclass(frozen=True, slots=True)
class Scene:
    """One moment of a flight.

    Attributes:
        title: what is flown. legs: their names.
        period_ms: of the control cycle, NaN where it is not known.
        status: the last step's.
        clock_s: time since the first step.
        cycle_hz, sent_hz: control cycles and setpoints over the last seconds.
        cycle_ms, solve_ms: medians of the last cycles; last_solve_ms: of this one. NaN where there is none.
        notes: what was announced, newest first.
    """

    title: str
    legs: tuple[str, ...]
    period_ms: float
    status: Status
    clock_s: float
    cycle_hz: float
    sent_hz: float
    cycle_ms: float
    solve_ms: float
    last_solve_ms: float
    notes: tuple[Note, ...]


class Recent:
    """Takes in a flight step by step and gives its scene at any moment."""

    def __init__(self, title: str) -> None:
        """Begin with a title."""
        self._title = title
        self._legs: tuple[str, ...] = ()
        self._period_ms = math.nan
        self._first_s: float | None = None
        self._cycles_s: deque[float] = deque()
        self._sent_s: deque[float] = deque()
        self._cycle_ms: deque[float] = deque(maxlen=SOLVES)
        self._solve_ms: deque[float] = deque(maxlen=SOLVES)
        self._notes: deque[Note] = deque(maxlen=NOTES)
        self._last: tuple[Status, Cycle] | None = None

    def plan(self, plan: FlightPlan) -> None:
        """Take names and rate from what is to be flown."""
        names = (plan.mission.name, plan.airframe.name, plan.scenario.name if plan.scenario is not None else "")
        self._title = " · ".join(("uasfly", *filter(None, names)))
        self._legs = tuple(leg.name or leg.type.replace("_", " ") for leg in plan.mission.legs)
        self._period_ms = 1e3 / plan.airframe.controller.rate_hz

    def take(self, status: Status, cycle: Cycle) -> None:
        """One step."""
        now = status.time_s
        if self._first_s is None:
            self._first_s = now
        self._last = status, cycle
        self._cycles_s.append(now)
        if cycle.sent:
            self._sent_s.append(now)
        for times in (self._cycles_s, self._sent_s):
            while times and times[0] <= now - WINDOW_S:
                times.popleft()
        self._cycle_ms.append(cycle.cycle_ms)
        if cycle.solve_ms is not None:
            self._solve_ms.append(cycle.solve_ms)
        for severity, text in status.announcements:
            self._note(Note(now - self._first_s, severity, text))

    @property
    def status(self) -> Status | None:
        """The last step's; None before the first."""
        return None if self._last is None else self._last[0]

    def scene(self) -> Scene | None:
        """The present moment; None before the first step."""
        if self._last is None or self._first_s is None:
            return None
        status, cycle = self._last
        clock_s = status.time_s - self._first_s
        window_s = min(WINDOW_S, clock_s)
        return Scene(
            title=self._title,
            legs=self._legs,
            period_ms=self._period_ms,
            status=status,
            clock_s=clock_s,
            cycle_hz=len(self._cycles_s) / window_s if window_s > 0.0 else math.nan,
            sent_hz=len(self._sent_s) / window_s if window_s > 0.0 else math.nan,
            cycle_ms=statistics.median(self._cycle_ms),
            solve_ms=statistics.median(self._solve_ms) if self._solve_ms else math.nan,
            last_solve_ms=math.nan if cycle.solve_ms is None else cycle.solve_ms,
            notes=tuple(reversed(self._notes)),
        )

    def _note(self, note: Note) -> None:
        """What repeats itself takes one line, so that it does not push out the rest."""
        if self._notes and self._notes[-1].text == note.text:
            note = replace(note, times=self._notes.pop().times + 1)
        self._notes.append(note)
