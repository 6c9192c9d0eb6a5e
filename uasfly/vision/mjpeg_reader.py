"""Reads an MJPEG stream over HTTP itself: no queue as in FFmpeg, and the time stamps that come with the frames."""

from __future__ import annotations

import http.client
import socket
import time
import urllib.parse
from collections.abc import Callable

import numpy as np

from uasfly.vision.frames import Image
from uasfly.vision.grabbers import OPEN_TIMEOUT_S, READ_TIMEOUT_S, SourceLostError

MULTIPART = "multipart/x-mixed-replace"
TIME_HEADER = b"x-timestamp"
CLOCK_HEADER = b"x-clock"  # `monotonic` says that the stamps are of this machine's monotonic clock
OLDEST_STAMP_S = 5.0  # a stamp older than this, or of the future, is not believed
_LONGEST_LINE = 4096
_MOST_LINES = 100
_LARGEST_PICTURE = 64 << 20


class NoMjpegError(SourceLostError):
    """Something else than MJPEG is served there; OpenCV may know it."""


class MjpegGrabber:
    """Frames of one HTTP stream.

    Args:
        url: http://...
        clock: seconds, the monotonic clock that the stamps are compared with.

    Raises:
        NoMjpegError: the server sends something else.
        SourceLostError: it cannot be reached.
    """

    def __init__(self, url: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._url = url
        self._clock = clock
        parts = urllib.parse.urlsplit(url)
        try:
            connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=OPEN_TIMEOUT_S)
            target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
            connection.request("GET", target, headers={"User-Agent": "uasfly"})
            self._socket: socket.socket | None = connection.sock
            connection.sock.settimeout(READ_TIMEOUT_S)
            self._answer = connection.getresponse()
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise SourceLostError(f"camera {url}: expected an answer, found {_reason(error)}") from None
        self._connection = connection
        kind = self._answer.getheader("Content-Type") or "nothing"
        if self._answer.status != http.client.OK or not kind.lower().startswith(MULTIPART):
            self.release()
            raise NoMjpegError(f"camera {url}: expected {MULTIPART}, found {kind} (status {self._answer.status})")

    def read(self) -> tuple[Image, float | None]:
        """See `Grabber`; pictures that cannot be decoded are left out."""
        import cv2

        while True:
            try:
                headers, data = self._part()
            except (OSError, http.client.HTTPException, ValueError) as error:
                raise SourceLostError(f"camera {self._url}: expected another frame, found {_reason(error)}") from None
            picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
            if picture is not None:
                return np.asarray(picture, dtype=np.uint8), self._stamp(headers)

    def stop(self) -> None:
        """See `Grabber`."""
        if self._socket is not None:
            try:
                self._socket.shutdown(socket.SHUT_RDWR)
            except OSError:
                return

    def release(self) -> None:
        """See `Grabber`."""
        self._answer.close()
        self._connection.close()

    def _part(self) -> tuple[dict[bytes, bytes], bytes]:
        """Headers (small letters) and body of the next part."""
        headers: dict[bytes, bytes] = {}
        for _ in range(_MOST_LINES):
            line = self._answer.readline(_LONGEST_LINE)
            if not line:
                raise ValueError("the end of the stream")
            name, colon, value = line.strip().partition(b":")
            if colon:
                headers[name.strip().lower()] = value.strip()
            elif not name and b"content-length" in headers:
                break
        size = int(headers.get(b"content-length", b"-1"))
        if not 0 <= size <= _LARGEST_PICTURE:
            raise ValueError(f"a part of {size} bytes" if size >= 0 else "a part without Content-Length")
        data = self._answer.read(size)
        if len(data) < size:
            raise ValueError("the end of the stream")
        return headers, data

    def _stamp(self, headers: dict[bytes, bytes]) -> float | None:
        if headers.get(CLOCK_HEADER) != b"monotonic":
            return None
        try:
            stamp_s = float(headers.get(TIME_HEADER, b""))
        except ValueError:
            return None
        return stamp_s if 0.0 <= self._clock() - stamp_s <= OLDEST_STAMP_S else None


def _reason(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return "silence"
    return str(error) or type(error).__name__
