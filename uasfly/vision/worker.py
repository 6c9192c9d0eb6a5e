"""Detection beside the control cycle, in a process of its own: it can neither delay the cycle nor hang it.

The process has the camera and the detector; to it go predictions, from it come what was seen. A thread of this process
talks to it, watches it, and starts it again when it is dead or hangs. No call of the worker blocks.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from uasfly.vision.frames import NOTICE, WARNING, Announcement
from uasfly.vision.worker_process import Failure, Job, Message, Seen, Started, Told, run

START_TIMEOUT_S = 30.0
HUNG_S = 3.0  # without a word of it, it hangs; a picture takes a tenth of that at most
FIRST_WAIT_S, LONGEST_WAIT_S = 0.2, 5.0
CLOSE_TIMEOUT_S = 0.9
MOST_RESULTS = 100  # kept for a caller who does not come
_TURN_S = 0.1

Result = TypeVar("Result")
Prediction = TypeVar("Prediction")


@dataclass(slots=True)
class WorkerCounts:
    """What a worker has done: frames looked at, frames that were never taken, starts of the process, its last id."""

    frames: int = 0
    skipped: int = 0
    starts: int = 0
    pid: int = 0


class DetectionWorker(Generic[Prediction, Result]):
    """Looks at the newest frames of a camera in a process of its own.

    Args:
        job: opens the camera and makes the detector there; it is pickled.
        hung_s: silence after which the process is taken to hang.
        clock: seconds, monotonic.

    Attributes:
        counts: what has been done.
    """

    def __init__(
        self, job: Job[Prediction, Result], hung_s: float = HUNG_S, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._job = job
        self._hung_s = hung_s
        self._clock = clock
        self._lock = threading.Lock()
        self._seen: list[Seen[Result]] = []
        self._announcements: list[Announcement] = []
        self._prediction: Prediction | None = None
        self._stop = threading.Event()
        self._troubled = False
        self.counts = WorkerCounts()
        self._thread = threading.Thread(target=self._supervise, name="detection", daemon=True)
        self._thread.start()

    def predict(self, prediction: Prediction | None) -> None:
        """What is to be expected in the next frame; the newest counts."""
        self._prediction = prediction

    def take(self) -> list[Seen[Result]]:
        """What has been seen since the last call, oldest first."""
        with self._lock:
            seen, self._seen = self._seen, []
            return seen

    def take_announcements(self) -> list[Announcement]:
        """What the pilot should know of camera and detection since the last call."""
        with self._lock:
            announcements, self._announcements = self._announcements, []
            return announcements

    def close(self) -> None:
        """End the process, within a second whatever hangs."""
        self._stop.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    def _supervise(self) -> None:
        wait_s = FIRST_WAIT_S
        while not self._stop.is_set():
            frames = self.counts.frames
            reason = self._live()
            if self._stop.is_set():
                break
            self._troubled = True
            self._announce(WARNING, f"marker detection {reason}; starting it again")
            wait_s = FIRST_WAIT_S if self.counts.frames > frames else min(2.0 * wait_s, LONGEST_WAIT_S)
            self._stop.wait(wait_s)

    def _live(self) -> str:
        """One life of the process; why it ended."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=run, args=(theirs, self._job), daemon=True, name="uasfly detection")
        try:
            process.start()
        except Exception as error:
            return f"does not start ({type(error).__name__}: {error})"
        theirs.close()  # so that the end of the process ends the pipe
        self.counts.starts += 1
        self.counts.pid = process.pid or 0
        try:
            return self._listen(ours)
        finally:
            process.kill()
            process.join(CLOSE_TIMEOUT_S)
            ours.close()

    def _listen(self, pipe: Connection[Any, Any]) -> str:
        heard_s, patience_s = self._clock(), START_TIMEOUT_S
        while not self._stop.is_set():
            try:
                if pipe.poll(_TURN_S):
                    message: Message = pipe.recv()
                    heard_s = self._clock()
                    if isinstance(message, Failure):
                        return message.text
                    if isinstance(message, Started):
                        patience_s = self._hung_s
                    self._take_in(message)
                    if not isinstance(message, Told):
                        pipe.send(self._prediction)  # it asks for one with each: the pipe never fills
            except (EOFError, OSError):
                return "has died"
            if self._clock() - heard_s > patience_s:
                return f"hangs (silent for {patience_s:g} s)"
        return "was closed"

    def _take_in(self, message: Message) -> None:
        if isinstance(message, Told):
            self._announce(*message.announcement)
        if isinstance(message, Seen):
            self.counts.frames += 1
            self.counts.skipped = message.skipped
            with self._lock:
                self._seen.append(message)
                del self._seen[:-MOST_RESULTS]
            if self._troubled:
                self._troubled = False
                self._announce(NOTICE, "marker detection works again")

    def _announce(self, severity: int, text: str) -> None:
        with self._lock, contextlib.suppress(IndexError):
            self._announcements.append((severity, text))
            del self._announcements[:-MOST_RESULTS]
