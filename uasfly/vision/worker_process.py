"""The process of `worker`: takes the newest frame, looks at it, says what it saw."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from uasfly.errors import describe_error
from uasfly.vision.frames import WARNING, Announcement, Frame, FrameSource

NICENESS = 10
BEAT_S = 0.5  # it says something at least so often
_NAP_S = 0.002

Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)
Prediction = TypeVar("Prediction")
Prediction_contra = TypeVar("Prediction_contra", contravariant=True)


class Looker(Protocol[Prediction_contra, Result_co]):
    """What is done with a frame; its results are pickled."""

    def __call__(self, frame: Frame, prediction: Prediction_contra | None, /) -> Result_co:
        """Look at a frame, where the prediction says, or everywhere."""
        ...


@dataclass(frozen=True, slots=True)
class Job(Generic[Prediction, Result]):
    """What the process does; all of it can be pickled (functions of modules, `functools.partial` of them).

    Attributes:
        open_source: opens the camera.
        make_looker: makes what looks at its frames.
        niceness: by how much the process gives way to others.
    """

    open_source: Callable[[], FrameSource]
    make_looker: Callable[[], Looker[Prediction, Result]]
    niceness: int = NICENESS


@dataclass(frozen=True, slots=True)
class Seen(Generic[Result]):
    """What was seen in one frame.

    Attributes:
        exposed_s, arrived_s, sequence: see `Frame`.
        took_s: how long looking took.
        skipped: frames so far that came while others were looked at.
        result: what was seen.
    """

    exposed_s: float
    arrived_s: float
    sequence: int
    took_s: float
    skipped: int
    result: Result


@dataclass(frozen=True, slots=True)
class Started:
    """Camera and detector are there."""


@dataclass(frozen=True, slots=True)
class Alive:
    """It waits for a frame."""


@dataclass(frozen=True, slots=True)
class Told:
    """Something for the pilot."""

    announcement: Announcement


@dataclass(frozen=True, slots=True)
class Failure:
    """It cannot work, and why."""

    text: str


Message: TypeAlias = Seen[Any] | Started | Alive | Told | Failure


def keep_to_half_of_the_cores() -> None:
    """The other half stays free, and its caches warm, for the flight: priorities alone let its worst cycles double.

    Raises:
        OSError: the system does not let us.
    """
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, cores[len(cores) // 2 :])


def run(pipe: Connection[Any, Any], job: Job[Any, Any]) -> None:
    """Work until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the flight, which ends this process
    with contextlib.suppress(OSError):
        os.nice(job.niceness)
        keep_to_half_of_the_cores()
    import cv2

    cv2.setNumThreads(1)
    with contextlib.suppress(EOFError, OSError):  # the other end is gone
        try:
            looker = job.make_looker()
            source = job.open_source()
        except Exception as error:
            pipe.send(Failure(f"cannot begin: {describe_error(error)}"))
            return
        try:
            _work(pipe, source, looker)
        finally:
            source.close()


def _work(pipe: Connection[Any, Any], source: FrameSource, looker: Looker[Any, Any]) -> None:
    pipe.send(Started())
    prediction: Any = pipe.recv()
    said_s, looked, failed = time.monotonic(), 0, False
    while True:
        for announcement in source.take_announcements():
            pipe.send(Told(announcement))
        frame = source.take()
        if frame is None:
            if time.monotonic() - said_s > BEAT_S:
                pipe.send(Alive())
                prediction, said_s = pipe.recv(), time.monotonic()
            time.sleep(_NAP_S)
            continue
        start_s = time.monotonic()
        try:
            result = looker(frame, prediction)
        except Exception as error:  # one odd picture is no end
            if not failed:
                pipe.send(Told((WARNING, f"marker detection failed on a picture: {describe_error(error)}")))
            failed = True
            continue
        looked += 1
        took_s = time.monotonic() - start_s
        skipped = frame.sequence + 1 - looked
        pipe.send(Seen(frame.exposed_s, frame.arrived_s, frame.sequence, took_s, skipped, result))
        prediction, said_s = pipe.recv(), time.monotonic()
