from __future__ import annotations

import contextlib
import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest

from tests.sim_camera import views
from uasfly.errors import LinkError
from uasfly.link.ports import free_udp_port
from uasfly.sim.camera import mjpeg
from uasfly.sim.camera.mjpeg import MjpegServer

PATIENCE_S = 15.0


def picture(number: int) -> np.ndarray:
    """A picture of one brightness."""
    return np.full((48, 64), 10 * (number % 20) + 20, dtype=np.uint8)


class Publisher:
    """Publishes pictures, one after the other, in a thread."""

    def __init__(self, server: MjpegServer, period_s: float = 0.02) -> None:
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(server, period_s), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End it."""
        self._stop.set()
        self._thread.join()

    def _run(self, server: MjpegServer, period_s: float) -> None:
        number = 0
        while not self._stop.wait(period_s):
            server.publish(picture(number), time.monotonic())
            number += 1


@pytest.fixture
def server() -> Iterator[MjpegServer]:
    """A server with somebody who publishes."""
    server = MjpegServer()
    publisher = Publisher(server)
    yield server
    publisher.stop()
    server.close()


def until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds, for a long time at most."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)


def asked(server: MjpegServer, request: bytes = b"GET / HTTP/1.0\r\n\r\n") -> socket.socket:
    """A connection on which a request has been sent."""
    connection = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)
    connection.sendall(request)
    return connection


def test_opencv_opens_it_like_an_ip_camera(server: MjpegServer) -> None:
    """`cv2.VideoCapture` of the URL gives the pictures."""
    if not any("FFMPEG" in line and "YES" in line for line in cv2.getBuildInformation().splitlines()):
        pytest.skip("this OpenCV has no FFmpeg")
    capture = cv2.VideoCapture(server.url, cv2.CAP_FFMPEG)
    assert capture.isOpened()
    seen = [capture.read() for _ in range(3)]
    capture.release()
    assert all(good and image.shape == (48, 64, 3) for good, image in seen)


def test_parts_say_when_they_were_exposed(server: MjpegServer) -> None:
    """Each part has the time of its exposure and the clock that it is of."""
    connection = asked(server)
    data = b""
    while data.count(b"X-Timestamp") < 2:
        piece = connection.recv(4096)
        assert piece
        data += piece
    connection.close()
    stamps = [float(line.split(b":")[1]) for line in data.split(b"\r\n") if line.startswith(b"X-Timestamp")]
    assert stamps == sorted(stamps)
    assert 0.0 <= time.monotonic() - stamps[-1] < PATIENCE_S
    assert b"X-Clock: monotonic" in data
    assert b"multipart/x-mixed-replace" in data


def test_several_watch_at_once_and_too_many_are_told_so(server: MjpegServer) -> None:
    """Up to MOST_CLIENTS are served; the next is refused, until one has gone."""
    watching = [asked(server) for _ in range(mjpeg.MOST_CLIENTS)]
    assert all(b"200" in connection.recv(64) for connection in watching)
    refused = asked(server)
    assert b"503" in refused.recv(64)
    refused.close()
    watching.pop().close()

    def admitted() -> bool:
        with asked(server) as connection:
            return b"200" in connection.recv(64)

    until(admitted)
    for connection in watching:
        connection.close()
    until(lambda: not server.watched)


def test_nothing_is_encoded_while_nobody_watches() -> None:
    """A picture that nobody sees costs nothing and is not kept."""
    server = MjpegServer()
    server.publish(picture(0), 1.0)
    assert server._newest is None
    server.close()


def test_one_that_never_reads_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is let go after a while, and the others get their pictures meanwhile."""
    monkeypatch.setattr(mjpeg._Handler, "timeout", 0.5)
    server = MjpegServer()
    noise = np.random.default_rng(1).integers(0, 256, (480, 640), dtype=np.uint8)
    lazy = asked(server)
    busy = asked(server)
    received = 0
    deadline = time.monotonic() + PATIENCE_S
    busy.settimeout(0.02)
    while server._watching != 1 or received < 3e6:
        assert time.monotonic() < deadline
        server.publish(noise, time.monotonic())
        try:
            received += len(busy.recv(1 << 20))
        except TimeoutError:
            continue
    lazy.close()
    busy.close()
    server.close()


@pytest.mark.parametrize(
    "request_bytes",
    [
        b"\r\n\r\n",
        b"\x00\xff\xfe garbage \r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"G" * 70_000,
        b"GET / HTTP/1.0\r\n" + b"A: b\r\n" * 500 + b"\r\n",
        b"",
    ],
)
def test_garbage_does_not_disturb_it(server: MjpegServer, request_bytes: bytes) -> None:
    """Whatever is sent, and however the sender goes, the next client is served."""
    connection = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)
    with contextlib.suppress(OSError):
        connection.sendall(request_bytes)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
    connection.close()
    with asked(server) as next_one:
        assert b"200" in next_one.recv(64)


def test_a_taken_port_is_named() -> None:
    """Two servers cannot have one port; the error says which."""
    server = MjpegServer()
    with pytest.raises(LinkError, match=str(server.port)):
        MjpegServer(server.port)
    server.close()


def test_a_camera_process_renders_what_its_vehicle_exposes() -> None:
    """The stream of the camera's process shows the bundle; the process ends with its parent's end of the pipe."""
    from uasfly.sim.camera.process import CameraProcess
    from uasfly.vision.mjpeg_reader import MjpegGrabber

    camera, settings = views.camera(latency_s=0.03), views.clean(rate_hz=50.0)
    body = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    with CameraProcess(camera, views.single(), settings, seed=1) as process:
        stop = threading.Event()

        def fly() -> None:
            start_s, step = time.monotonic(), 0
            while not stop.wait(0.004):
                step += 1
                process.feed.watch(0.004 * step, body, None)
                process.feed.send(start_s + 0.004 * step)

        thread = threading.Thread(target=fly, daemon=True)
        thread.start()
        grabber = MjpegGrabber(process.url)
        for _ in range(3):
            image, exposed_s = grabber.read()
            age_s = time.monotonic() - (exposed_s or 0.0)
            assert image.shape == (480, 640)
            assert 0.03 <= age_s < PATIENCE_S
        grabber.release()
        stop.set()
        thread.join()
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
        assert np.ravel(detector.detectMarkers(image)[1]).tolist() == [5]
    assert not process.alive


def test_a_camera_process_that_cannot_start_says_why() -> None:
    """What is wrong with the job comes back as an error."""
    from uasfly.bundle import Bundle
    from uasfly.sim.camera.process import CameraProcess

    bundle = Bundle.model_validate({"name": "s", "family": "stag_hd21", "markers": [{"id": 0, "size_m": 0.1}]})
    with pytest.raises(LinkError, match="cannot print markers of the family stag_hd21"):
        CameraProcess(views.camera(), bundle, views.clean(), seed=1)


def test_a_vehicle_over_mavlink_has_its_camera_beside_it() -> None:
    """The vehicle's process tells the stream's URL; its frames carry the host's time; both end together."""
    from uasfly.files import find_file, load_file
    from uasfly.sim.mavlink.process import start_process
    from uasfly.sim.plant import Plant
    from uasfly.sim.scenario import Scenario
    from uasfly.vision.mjpeg_reader import MjpegGrabber

    down = {"position_m": (0.0, 0.0, 0.5), "rpy_deg": (180.0, 0.0, -90.0)}
    camera = views.camera(latency_s=0.02, transform_camera_to_body=down)
    settings = views.clean(bundle={"on": "floor", "position_m": (0.0, 0.0, 0.0)})
    plant = load_file(find_file("plant", "f550"), Plant)
    scenario = Scenario(name="test", camera=settings)
    with start_process(
        plant, scenario, 1, remote_port=free_udp_port(), camera=camera, bundle=views.single()
    ) as vehicle:
        grabber = MjpegGrabber(vehicle.camera_url)
        times = []
        for _ in range(5):
            image, exposed_s = grabber.read()
            assert exposed_s is not None
            times.append(exposed_s)
        grabber.release()
    assert all(later > earlier for earlier, later in itertools.pairwise(times))
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    assert np.ravel(detector.detectMarkers(image)[1]).tolist() == [5]
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", int(vehicle.camera_url.split(":")[2].split("/")[0])), timeout=1.0)
