"""Camera frames and the slot that holds the newest one."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Announcement = tuple[int, str]  # severity as in MAVLink, text

WARNING, NOTICE = 4, 5


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame of a camera.

    Attributes:
        exposed_s: middle of its exposure, host's monotonic clock.
        arrived_s: when it was there.
        sequence: counts the frames of a source; what was never taken leaves gaps.
        image: (height, width), gray.
    """

    exposed_s: float
    arrived_s: float
    sequence: int
    image: Image


class FrameSource(Protocol):
    """Where frames come from. No call blocks; the newest frame wins, there is no queue."""

    def take(self) -> Frame | None:
        """The newest frame, once; None where there is no new one."""
        ...

    def take_announcements(self) -> list[Announcement]:
        """What the pilot should know about the camera since the last call."""
        ...

    @property
    def ended(self) -> bool:
        """Whether no frame will come any more."""
        ...

    def close(self) -> None:
        """Give the camera back, within a second whatever hangs."""
        ...


class FrameSlot:
    """Holds one frame, the newest; for one thread that puts and one that takes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frame: Frame | None = None
        self._count = 0
        self._overwritten = 0

    def put(self, image: Image, exposed_s: float, arrived_s: float) -> None:
        """Take the place of what is there."""
        with self._lock:
            self._overwritten += self._frame is not None
            self._frame = Frame(exposed_s, arrived_s, self._count, image)
            self._count += 1

    def take(self) -> Frame | None:
        """What is there, once."""
        with self._lock:
            frame, self._frame = self._frame, None
            return frame

    @property
    def count(self) -> int:
        """Frames that were put."""
        return self._count

    @property
    def overwritten(self) -> int:
        """Frames that nobody took."""
        return self._overwritten
