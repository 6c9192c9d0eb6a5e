"""Shows a flight from a thread of its own: a slow, stopped or vanished terminal never delays a control cycle."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

from uasfly.errors import describe_error
from uasfly.flight.tracking_errors import MarkerDatum
from uasfly.message_class import message
from uasfly.messages import Sample, Status

BACKLOG = 200  # steps that wait for a terminal; beyond them only those that announce something are kept
CLOSE_TIMEOUT_S = 1.0


@message
class Cycle:
    """What only the driver knows of a cycle.

    Attributes:
        sent: a setpoint has left.
        cycle_ms: time of the whole step by the driver's clock.
        solve_ms: time of the solver in it, None where nothing was solved.
    """

    sent: bool
    cycle_ms: float
    solve_ms: float | None


Watch = Callable[[Status, Cycle], None]
# A step's status, the samples that it took in with the truth among them, and where the marker is (see `TrueMarkers`).
Witness = Callable[[Status, tuple[Sample, ...], MarkerDatum | None], None]


class BackgroundWatch:
    """Hands each step's status on to a callback in another thread.

    Attributes:
        problem: why nothing is shown any more, "" while it is.
    """

    def __init__(self, watch: Watch) -> None:
        """Take the callback and start the thread."""
        self.problem = ""
        self._watch = watch
        self._queue: queue.SimpleQueue[tuple[Status, Cycle] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="live view", daemon=True)
        self._thread.start()

    def __call__(self, status: Status, cycle: Cycle) -> None:
        """Hand one step over; returns at once."""
        if status.announcements or self._queue.qsize() < BACKLOG:
            self._queue.put((status, cycle))

    def close(self) -> None:
        """Show what is left; a terminal that takes nothing is not waited for longer than a second."""
        self._queue.put(None)
        self._thread.join(CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            if self.problem:
                continue
            try:
                self._watch(*item)
            except Exception as error:
                self.problem = f"the live view stopped: {describe_error(error)}"
