"""Camera sources: a thread reads frames as they come, the newest is there to be taken.

A source that is lost is opened again, less and less often; losing and finding it is announced.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

from uasfly.errors import UasflyError, describe_error, shortened
from uasfly.vision.frames import NOTICE, WARNING, Announcement, Frame, FrameSlot
from uasfly.vision.grabbers import EndOfFramesError, Grabber, OpenCvGrabber, SourceLostError, folder, video_file
from uasfly.vision.mjpeg_reader import MjpegGrabber, NoMjpegError

FIRST_WAIT_S, LONGEST_WAIT_S = 0.25, 5.0
CLOSE_TIMEOUT_S = 0.8
STREAMS = ("rtsp://", "rtsps://", "http://", "https://", "udp://", "tcp://", "rtp://")
FOLDER_RATE_HZ = 10.0


class GrabbingSource:
    """Frames that a thread of its own reads from whatever `opener` opens; see `FrameSource`.

    Args:
        name: for the announcements.
        opener: opens the source; called again after a loss.
        latency_s: arrival minus mid-exposure, for frames that carry no time stamp.
        clock: seconds, monotonic.
    """

    def __init__(
        self,
        name: str,
        opener: Callable[[], Grabber],
        latency_s: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._name = shortened(name)
        self._opener = opener
        self._latency_s = latency_s
        self._clock = clock
        self._slot = FrameSlot()
        self._announcements: list[Announcement] = []
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._grabber: Grabber | None = None
        self._ended = False
        self._lost = False
        self._thread = threading.Thread(target=self._run, name=f"camera {self._name}", daemon=True)
        self._thread.start()

    def take(self) -> Frame | None:
        """See `FrameSource`."""
        return self._slot.take()

    def take_announcements(self) -> list[Announcement]:
        """See `FrameSource`."""
        with self._lock:
            taken, self._announcements = self._announcements, []
            return taken

    @property
    def ended(self) -> bool:
        """See `FrameSource`."""
        return self._ended

    @property
    def counts(self) -> tuple[int, int]:
        """Frames that have come, and how many of them nobody took."""
        return self._slot.count, self._slot.overwritten

    def close(self) -> None:
        """See `FrameSource`; a thread that hangs in the camera's driver is left behind, it holds no other thing."""
        self._stop.set()
        grabber = self._grabber
        if grabber is not None:
            grabber.stop()
        self._thread.join(CLOSE_TIMEOUT_S)
        self._ended = True

    def _run(self) -> None:
        wait_s = FIRST_WAIT_S
        while not self._stop.is_set():
            try:
                self._grabber = self._opener()
                wait_s = self._read_all(self._grabber, wait_s)
            except SourceLostError as error:
                self._say_lost(str(error))
            except EndOfFramesError:
                self._announce(NOTICE, f"camera {self._name}: its pictures are at their end")
                break
            except Exception as error:
                self._say_lost(describe_error(error))
            self._stop.wait(wait_s)
            wait_s = min(2.0 * wait_s, LONGEST_WAIT_S)
        self._ended = True

    def _read_all(self, grabber: Grabber, wait_s: float) -> float:
        """Read until the source is lost; gives the next wait where it is lost right away."""
        try:
            while not self._stop.is_set():
                try:
                    image, exposed_s = grabber.read()
                except SourceLostError as error:
                    if not self._stop.is_set():
                        self._say_lost(str(error))
                    return wait_s
                arrived_s = self._clock()
                self._slot.put(image, arrived_s - self._latency_s if exposed_s is None else exposed_s, arrived_s)
                wait_s = FIRST_WAIT_S
                if self._lost:
                    self._lost = False
                    self._announce(NOTICE, f"camera {self._name}: frames come again")
        finally:
            grabber.release()
        return wait_s

    def _say_lost(self, text: str) -> None:
        if not self._lost:
            self._lost = True
            self._announce(WARNING, f"{text}; trying again")

    def _announce(self, severity: int, text: str) -> None:
        with self._lock:
            self._announcements.append((severity, text))


def open_source(
    target: str, latency_s: float = 0.0, rate_hz: float | None = None, loop: bool = False
) -> GrabbingSource:
    """The source that a text names.

    Args:
        target: index of a camera ("0"), its device (/dev/video0), a stream (rtsp://..., http://...), a video file, or a
            folder of pictures.
        latency_s: arrival minus mid-exposure, for frames that carry no time stamp.
        rate_hz: pictures a second from a file or folder; a video's own rate and FOLDER_RATE_HZ when not given.
        loop: begin a folder again after its last picture.

    Raises:
        UasflyError: there is nothing of that name, or it is no camera.
    """
    if target.lower().startswith(STREAMS):
        return GrabbingSource(target, lambda: _open_stream(target), latency_s)
    if target.isdecimal() and len(target) < 6:
        return _device(int(target), Path(f"/dev/video{int(target)}"), latency_s)
    path = Path(target)
    try:
        if path.is_char_device():
            return _device(target, path, latency_s)
        if target and path.is_dir():
            pictures: Grabber = folder(path, rate_hz or FOLDER_RATE_HZ, loop)
            return GrabbingSource(target, _once(pictures), latency_s)
        if path.is_file():
            return GrabbingSource(target, _once(video_file(path, rate_hz)), latency_s)
    except (OSError, ValueError) as error:
        raise UasflyError(f"camera {shortened(target)}: it cannot be read: {error}") from None
    if target.startswith("/dev/"):
        return _device(target, path, latency_s)
    raise UasflyError(
        f"camera {shortened(target) or 'of no name'}: expected an index (0), a device (/dev/video0), a stream "
        f"({STREAMS[0]}... {STREAMS[2]}...), a video file or a folder of pictures; found no such thing{_there_are()}"
    )


def _device(target: int | str, path: Path, latency_s: float) -> GrabbingSource:
    if not path.exists():
        raise UasflyError(f"camera {target}: expected the device {path}, found none; is it plugged in?{_there_are()}")
    return GrabbingSource(str(target), lambda: OpenCvGrabber(target), latency_s)


def _there_are() -> str:
    try:
        devices = sorted(str(device) for device in Path("/dev").glob("video*"))
    except OSError:
        devices = []
    return f" (there are {', '.join(devices)})" if devices else " (this computer has no /dev/video*)"


def _open_stream(url: str) -> Grabber:
    if url.lower().startswith("http://"):
        try:
            return MjpegGrabber(url)
        except NoMjpegError:
            pass
    return OpenCvGrabber(url)


def _once(grabber: Grabber) -> Callable[[], Grabber]:
    """Opener of what cannot be lost."""
    return lambda: grabber
