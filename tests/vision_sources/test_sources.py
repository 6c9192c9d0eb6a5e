from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from uasfly.errors import UasflyError, shortened
from uasfly.sim.camera.mjpeg import MjpegServer
from uasfly.vision import grabbers, sources
from uasfly.vision.frames import Announcement, Frame, FrameSlot, Image
from uasfly.vision.sources import GrabbingSource, open_source

PATIENCE_S = 20.0
CLOSED_WITHIN_S = 1.0


def until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds, for a long time at most."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)


def next_frame(source: GrabbingSource) -> Frame:
    """Wait for a frame."""
    found: list[Frame] = []

    def taken() -> bool:
        frame = source.take()
        if frame is not None:
            found.append(frame)
        return bool(found)

    until(taken)
    return found[0]


def closed_in(source: GrabbingSource) -> float:
    """Close a source; how long that takes [s]."""
    start_s = time.monotonic()
    source.close()
    return time.monotonic() - start_s


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """A folder with three pictures of brightness 0, 100 and 200, and things that are none."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(3):
        cv2.imwrite(str(folder / f"{number}.png"), np.full((40, 60, 3), 100 * number, dtype=np.uint8))
    (folder / "0_broken.png").write_bytes(b"no picture")
    (folder / "notes.txt").write_text("text")
    return folder


def test_the_newest_frame_wins() -> None:
    """What nobody takes is overwritten and counted; a frame is taken once."""
    slot = FrameSlot()
    assert slot.take() is None
    for number in range(3):
        slot.put(np.full((2, 2), number, dtype=np.uint8), float(number), float(number))
    frame = slot.take()
    assert frame is not None
    assert (frame.sequence, frame.exposed_s, int(frame.image[0, 0])) == (2, 2.0, 2)
    assert slot.take() is None
    assert (slot.count, slot.overwritten) == (3, 2)


def test_a_folder_gives_its_pictures_in_order_and_ends(pictures: Path) -> None:
    """By name, gray, at the given rate; broken ones are left out; the end is announced."""
    grabber = grabbers.folder(pictures, rate_hz=20.0)
    frames = [grabber.read() for _ in range(3)]
    with pytest.raises(grabbers.EndOfFramesError):
        grabber.read()
    assert [int(image[0, 0]) for image, _ in frames] == [0, 100, 200]
    assert frames[0][0].shape == (40, 60)
    assert np.diff([exposed_s or 0.0 for _, exposed_s in frames]).min() > 0.049
    source = open_source(str(pictures), rate_hz=100.0)
    until(lambda: source.ended)
    assert source.counts[0] == 3
    assert [text for _, text in source.take_announcements()] == [
        f"camera {shortened(str(pictures))}: its pictures are at their end"
    ]
    assert closed_in(source) < CLOSED_WITHIN_S


def test_a_folder_may_begin_again(pictures: Path) -> None:
    """With `loop` it never ends."""
    source = open_source(str(pictures), rate_hz=200.0, loop=True)
    until(lambda: source.counts[0] > 6)
    assert not source.ended
    source.close()


def test_a_video_file_is_played(tmp_path: Path) -> None:
    """A file that OpenCV has written gives its frames, gray."""
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (64, 48))
    if not writer.isOpened():
        pytest.skip("this OpenCV writes no MJPG video")
    for number in range(10):
        writer.write(np.full((48, 64, 3), 20 * number, dtype=np.uint8))
    writer.release()
    source = open_source(str(path))
    frame = next_frame(source)
    assert frame.image.shape == (48, 64)
    until(lambda: source.ended)
    assert source.counts[0] == 10
    source.close()


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("", "of no name"),
        ("there/is/no/such/thing", "found no such thing"),
        ("77", "expected the device /dev/video77"),
        ("/dev/video77", "expected the device /dev/video77"),
        ("a\0b", "camera"),
        ("x" * 5000, "camera"),
    ],
)
def test_what_is_no_camera_is_named(target: str, words: str) -> None:
    """The error says what was expected and what there is."""
    with pytest.raises(UasflyError, match=words):
        open_source(target)


def test_files_that_hold_no_pictures_are_named(tmp_path: Path) -> None:
    """A text is no video, and an empty folder has no pictures."""
    text = tmp_path / "text.mp4"
    text.write_text("no video")
    with pytest.raises(UasflyError, match="expected a video"):
        open_source(str(text))
    with pytest.raises(UasflyError, match="expected pictures"):
        open_source(str(tmp_path / ".." / tmp_path.name / "."))


class Publisher:
    """A server that publishes in a thread, one picture every 10 ms."""

    def __init__(self, port: int = 0) -> None:
        self.server = MjpegServer(port)
        self.stamp_s: Callable[[], float] = time.monotonic
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._stop.set()
        self._thread.join()
        self.server.close()

    def _run(self) -> None:
        while not self._stop.wait(0.01):
            self.server.publish(np.full((48, 64), 90, dtype=np.uint8), self.stamp_s())


@pytest.fixture
def publisher() -> Iterator[Publisher]:
    """A stream."""
    publisher = Publisher()
    yield publisher
    publisher.close()


def test_a_stream_with_time_stamps_is_believed(publisher: Publisher) -> None:
    """The exposure is what the server says, not the arrival minus a latency."""
    exposed_s = time.monotonic() - 0.5
    publisher.stamp_s = lambda: exposed_s
    source = open_source(publisher.server.url, latency_s=0.1)
    frame = next_frame(source)
    assert frame.exposed_s == pytest.approx(exposed_s, abs=1e-5)
    assert int(frame.image[0, 0]) == pytest.approx(90, abs=2)
    assert closed_in(source) < CLOSED_WITHIN_S


def test_impossible_time_stamps_are_not_believed(publisher: Publisher) -> None:
    """A stamp of the future, or a very old one, is replaced by the arrival minus the latency."""
    for offset_s in (-100.0, 100.0):

        def stamp_s(offset_s: float = offset_s) -> float:
            return time.monotonic() + offset_s

        publisher.stamp_s = stamp_s
        source = open_source(publisher.server.url, latency_s=0.1)
        frame = next_frame(source)
        assert frame.arrived_s - frame.exposed_s == pytest.approx(0.1)
        source.close()


def test_a_lost_stream_is_announced_and_found_again() -> None:
    """The server goes and comes: one announcement each, and frames again without anybody's doing."""
    publisher = Publisher()
    port = publisher.server.port
    source = open_source(publisher.server.url)
    next_frame(source)
    publisher.close()
    said: list[Announcement] = []

    def told(word: str) -> Callable[[], bool]:
        def heard() -> bool:
            said.extend(source.take_announcements())
            return any(word in text for _, text in said)

        return heard

    until(told("trying again"))
    time.sleep(0.6)
    publisher = Publisher(port)
    until(told("frames come again"))
    source.take()
    next_frame(source)
    assert len(said) == 2
    assert closed_in(source) < CLOSED_WITHIN_S
    publisher.close()


def _serve(answer: bytes, goes: bool) -> tuple[socket.socket, str]:
    """A server that sends one answer to whoever connects, and then hangs or goes."""
    listener = socket.create_server(("127.0.0.1", 0))

    def run() -> None:
        held = []
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            held.append(connection)
            try:
                connection.recv(4096)
                connection.sendall(answer)
            except OSError:
                continue
            if goes:
                connection.close()

    threading.Thread(target=run, daemon=True).start()
    return listener, f"http://127.0.0.1:{listener.getsockname()[1]}/"


HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=b\r\n\r\n"


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"HTTP/1.0 200 OK\r\n",
        HEAD,
        HEAD + b"--b\r\nContent-Type: image/jpeg\r\nContent-Length: 1000\r\n\r\nonly a little",
        HEAD + b"--b\r\nContent-Length: 4\r\n\r\nnone\r\n",
    ],
    ids=["no answer", "half a head", "no part", "half a part", "no picture"],
)
def test_a_server_that_stalls_is_lost_and_closes_at_once(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """However far it came, the caller is never held up, the loss is announced, and closing takes no second."""
    monkeypatch.setattr("uasfly.vision.mjpeg_reader.OPEN_TIMEOUT_S", 0.3)
    monkeypatch.setattr("uasfly.vision.mjpeg_reader.READ_TIMEOUT_S", 0.3)
    listener, url = _serve(answer, goes=False)
    source = open_source(url)
    start_s = time.monotonic()
    assert source.take() is None
    assert time.monotonic() - start_s < CLOSED_WITHIN_S
    said: list[Announcement] = []

    def heard() -> bool:
        said.extend(source.take_announcements())
        return bool(said)

    until(heard)
    assert "silence" in said[0][1]
    assert closed_in(source) < CLOSED_WITHIN_S
    listener.close()


@pytest.mark.parametrize(
    "part",
    [
        b"--b\r\nContent-Length: -5\r\n\r\n",
        b"--b\r\nContent-Length: 99999999999\r\n\r\n",
        b"--b\r\nContent-Length: many\r\n\r\n",
        b"\x00\xff" * 5000,
        b"A: b\r\n" * 5000,
        b"--b\r\nContent-Length: 0\r\n\r\n",
    ],
)
def test_a_broken_stream_is_a_lost_one(part: bytes) -> None:
    """Whatever a server sends, nothing worse than a loss comes of it."""
    listener, url = _serve(HEAD + part, goes=True)
    source = open_source(url)
    said: list[Announcement] = []

    def heard() -> bool:
        said.extend(source.take_announcements())
        return bool(said)

    until(heard)
    assert "trying again" in said[0][1]
    assert "internal error" not in said[0][1]
    assert closed_in(source) < CLOSED_WITHIN_S
    listener.close()


class HangingGrabber:
    """A driver that never comes back."""

    def __init__(self) -> None:
        self.hangs = threading.Event()
        self.forever = threading.Event()

    def read(self) -> tuple[Image, float | None]:
        """Hang."""
        self.hangs.set()
        self.forever.wait()
        raise grabbers.SourceLostError("it came back")

    def stop(self) -> None:
        """It does not listen."""

    def release(self) -> None:
        """Nothing to give back."""


def test_a_driver_that_hangs_for_good_is_left_behind() -> None:
    """Neither taking nor closing waits for it."""
    driver = HangingGrabber()
    source = GrabbingSource("hanging", lambda: driver)
    assert driver.hangs.wait(PATIENCE_S)
    assert source.take() is None
    assert closed_in(source) < CLOSED_WITHIN_S
    assert source.ended
    driver.forever.set()


def test_waits_between_attempts_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera that is not there is tried less and less often, and announced once."""
    monkeypatch.setattr(sources, "FIRST_WAIT_S", 0.02)
    tries: list[float] = []

    def opener() -> grabbers.Grabber:
        tries.append(time.monotonic())
        raise grabbers.SourceLostError("camera x: expected it to open, found that it does not")

    source = GrabbingSource("x", opener)
    until(lambda: len(tries) >= 5)
    gaps = np.diff(tries)
    assert gaps[3] > gaps[0]
    assert gaps[3] >= 0.02 * 8
    assert source.take_announcements() == [(4, "camera x: expected it to open, found that it does not; trying again")]
    source.close()
