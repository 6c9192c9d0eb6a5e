"""What frames are read from, one after the other and blocking: devices, streams, video files, folders of pictures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from uasfly.errors import UasflyError
from uasfly.vision.frames import Image

OPEN_TIMEOUT_S = 4.0
READ_TIMEOUT_S = 3.0
LONGEST_FRAME_RATE_HZ = 1000.0
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif", ".tiff", ".webp")


class SourceLostError(UasflyError):
    """A camera gives no frames; it is worth trying again."""


class EndOfFramesError(UasflyError):
    """A file or folder has been read to its end."""


class Grabber(Protocol):
    """An opened source of frames; its calls may block. `stop` may be called from another thread."""

    def read(self) -> tuple[Image, float | None]:
        """The next frame (height, width) and when it was exposed (monotonic clock), None where that is not told.

        Raises:
            SourceLostError: there is none any more, for now.
            EndOfFramesError: there will be none.
        """
        ...

    def stop(self) -> None:
        """Let a blocked `read` return soon, where that is possible."""
        ...

    def release(self) -> None:
        """Give the source back; called by the thread that reads."""
        ...


class OpenCvGrabber:
    """A device or a stream through OpenCV.

    Args:
        target: index of a device, its path, or a URL.

    Raises:
        SourceLostError: it cannot be opened.
    """

    def __init__(self, target: int | str) -> None:
        import cv2

        self._target = target
        if isinstance(target, str) and "://" in target:
            limits = [
                cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
                round(OPEN_TIMEOUT_S * 1e3),
                cv2.CAP_PROP_READ_TIMEOUT_MSEC,
                round(READ_TIMEOUT_S * 1e3),
            ]
            self._capture = cv2.VideoCapture(target, cv2.CAP_FFMPEG, limits)
        else:
            self._capture = cv2.VideoCapture(target)
            self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # where the driver has a queue, keep it short
        if not self._capture.isOpened():
            self._capture.release()
            raise SourceLostError(f"camera {target}: expected it to open, found that it does not")

    def read(self) -> tuple[Image, None]:
        """See `Grabber`."""
        good, picture = self._capture.read()
        if not good:
            raise SourceLostError(f"camera {self._target}: expected another frame, found none")
        return gray(picture), None

    def stop(self) -> None:
        """OpenCV's calls end by themselves after their time-outs."""

    def release(self) -> None:
        """See `Grabber`."""
        self._capture.release()


class PacedGrabber:
    """Pictures from files as if a camera took them: each when its time has come.

    Args:
        pictures: gives the next picture, None at the end.
        rate_hz: how many a second.
        clock: seconds, monotonic.
    """

    def __init__(
        self, pictures: Callable[[], Image | None], rate_hz: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._pictures = pictures
        self._period_s = 1.0 / min(max(rate_hz, 0.01), LONGEST_FRAME_RATE_HZ)
        self._clock = clock
        self._due_s = -math.inf
        self._stopped = False

    def read(self) -> tuple[Image, float]:
        """See `Grabber`; a frame counts as exposed when it is due, and what is late is not made up for."""
        picture = self._pictures()
        if picture is None:
            raise EndOfFramesError("the last picture has been read")
        self._due_s = max(self._due_s + self._period_s, self._clock())
        while not self._stopped and (wait_s := self._due_s - self._clock()) > 0.0:
            time.sleep(min(wait_s, 0.1))
        return picture, self._due_s

    def stop(self) -> None:
        """See `Grabber`."""
        self._stopped = True

    def release(self) -> None:
        """Nothing is held but memory."""


def video_file(path: Path, rate_hz: float | None = None) -> PacedGrabber:
    """A video file at its own rate, or another.

    Raises:
        UasflyError: OpenCV cannot read it.
    """
    import cv2

    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise UasflyError(f"{path}: expected a video that OpenCV reads (MP4, AVI, MKV ...), found something else")
    own_rate_hz = float(capture.get(cv2.CAP_PROP_FPS))

    def next_picture() -> Image | None:
        good, picture = capture.read()
        return gray(picture) if good else None

    return PacedGrabber(next_picture, rate_hz or own_rate_hz or 30.0)


def folder(path: Path, rate_hz: float, loop: bool = False) -> PacedGrabber:
    """The pictures of a folder in the order of their names; what cannot be read is left out.

    Args:
        path: the folder.
        rate_hz: pictures a second.
        loop: begin again after the last.

    Raises:
        UasflyError: there is no picture in it.
    """
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in PICTURES and file.is_file())
    if not files:
        raise UasflyError(f"{path}: expected pictures ({', '.join(PICTURES)}), found none; give a folder that has some")
    rest = list(reversed(files))

    def next_picture() -> Image | None:
        import cv2

        unread = 0
        while unread < len(files):
            if not rest:
                if not loop:
                    return None
                rest.extend(reversed(files))
            picture = cv2.imread(str(rest.pop()), cv2.IMREAD_GRAYSCALE)
            if picture is not None:
                return np.asarray(picture, dtype=np.uint8)
            unread += 1
        return None

    return PacedGrabber(next_picture, rate_hz)


def gray(picture: Any) -> Image:
    """A picture (h, w) or (h, w, 3), blue-green-red, as gray (h, w)."""
    import cv2

    if picture.ndim == 3:
        picture = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    return np.asarray(picture, dtype=np.uint8)
