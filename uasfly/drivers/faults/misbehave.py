"""Lets the running program misbehave from inside, for the fault table: a cycle that hangs, a solver that fails.

The process calls `misbehave` before the command line, see `live`.
"""

from __future__ import annotations

import time

from uasfly.control.iteration import RealTimeIteration
from uasfly.control.qp import SolveStatus
from uasfly.flight.pilot import Pilot, StepResult
from uasfly.messages import Array, Phase, Sample


class _Window:
    """From so long after the legs began, for a duration."""

    def __init__(self, begin_s: float, duration_s: float) -> None:
        self.begin_s, self.duration_s = begin_s, duration_s
        self.legs_s: float | None = None

    def holds(self, time_s: float) -> bool:
        """Whether it is open."""
        return self.legs_s is not None and 0.0 <= time_s - self.legs_s - self.begin_s < self.duration_s


def hang(window: _Window) -> None:
    """Let one step take as long as the window; everything else of the process goes on."""
    step = Pilot.step

    def hanging(self: Pilot, time_s: float, samples: tuple[Sample, ...]) -> StepResult:
        result = step(self, time_s, samples)
        _note(self, window, time_s)
        if window.holds(time_s):
            time.sleep(window.duration_s)
            window.duration_s = 0.0  # once
        return result

    Pilot.step = hanging  # type: ignore[method-assign]


def failing_solver(window: _Window) -> None:
    """Let every solve in the window fail, and leave the plan as it was."""
    step, solve = Pilot.step, RealTimeIteration.solve
    now = [0.0]

    def noting(self: Pilot, time_s: float, samples: tuple[Sample, ...]) -> StepResult:
        now[0] = time_s
        result = step(self, time_s, samples)
        _note(self, window, time_s)
        return result

    def failing(
        self: RealTimeIteration, start_s: float, iterations: int = 1, before: Array | None = None
    ) -> SolveStatus:
        return SolveStatus.FAILED if window.holds(now[0]) else solve(self, start_s, iterations, before)

    Pilot.step = noting  # type: ignore[method-assign]
    RealTimeIteration.solve = failing  # type: ignore[method-assign]


def _note(pilot: Pilot, window: _Window, time_s: float) -> None:
    if window.legs_s is None and pilot.sequencer.phase is Phase.LEGS:
        window.legs_s = time_s


def misbehave(what: str, begin_s: str, duration_s: str) -> None:
    """Prepare this process: "hang" or "fail", so long after the legs have begun [s], for so long [s]."""
    {"hang": hang, "fail": failing_solver}[what](_Window(float(begin_s), float(duration_s)))
