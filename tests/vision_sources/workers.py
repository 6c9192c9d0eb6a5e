"""Cameras and detectors that the worker's process makes for the tests; they are pickled by name."""

from __future__ import annotations

import os
import signal
import time

import numpy as np

from uasfly.vision.frames import Announcement, Frame


class Numbers:
    """A camera of endless frames; a picture's first pixel is its number."""

    def __init__(self) -> None:
        self.ended = False
        self._count = 0
        self._said = [(5, "the camera says hello")]

    def take(self) -> Frame | None:
        """The next one."""
        self._count += 1
        now_s = time.monotonic()
        image = np.full((4, 4), self._count % 256, dtype=np.uint8)
        return Frame(now_s - 0.02, now_s, self._count - 1, image)

    def take_announcements(self) -> list[Announcement]:
        """Hello, once."""
        said, self._said = self._said, []
        return said

    def close(self) -> None:
        """Nothing to do."""


class Still(Numbers):
    """A camera that gives no frame."""

    def take(self) -> Frame | None:
        """None."""
        return None


def read_number(frame: Frame, prediction: object) -> tuple[int, object]:
    """What the picture says, and what was predicted."""
    time.sleep(0.01)
    return int(frame.image[0, 0]), prediction


def fail(frame: Frame, prediction: object) -> None:
    """A detector that cannot cope with every third picture."""
    time.sleep(0.01)
    if frame.sequence % 3 == 0:
        raise RuntimeError("odd picture")


def hang(frame: Frame, prediction: object) -> None:
    """A detector that stops for good at its third picture."""
    if frame.sequence == 3:
        os.kill(os.getpid(), signal.SIGSTOP)


def make_read_number() -> object:
    """Looker of `read_number`."""
    return read_number


def make_fail() -> object:
    """Looker of `fail`."""
    return fail


def make_hang() -> object:
    """Looker of `hang`."""
    return hang


def make_nothing() -> object:
    """No detector."""
    raise RuntimeError("no detector of this name")
