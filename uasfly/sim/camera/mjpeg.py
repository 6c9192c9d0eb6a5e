"""Serves pictures as an MJPEG stream over HTTP, as an IP camera does; the newest picture wins.

Each client has a thread. One that does not read is let go after a while, and holds nobody else up.
"""

from __future__ import annotations

import contextlib
import http.server
import select
import socket
import threading
from typing import Any

from uasfly.errors import LinkError
from uasfly.sim.camera.optics import Image

MOST_CLIENTS = 8
CLIENT_TIMEOUT_S = 3.0
SEND_BUFFER = 1 << 17  # what lies in it is old when it is read
QUALITY = 95
_BOUNDARY = "frame"
_KEEP_WAITING_S = 0.5


class MjpegServer:
    """A stream that any number of clients (up to MOST_CLIENTS) may watch, under any path.

    Each part carries `X-Timestamp`, the middle of its exposure [s], and `X-Clock: monotonic`.

    Args:
        port: TCP port, 0 for any that is free.
        host: address to listen on.

    Raises:
        LinkError: the port is taken.

    Attributes:
        port: the port. url: what a client opens.
    """

    def __init__(self, port: int = 0, host: str = "127.0.0.1") -> None:
        self._newest: tuple[int, bytes, float] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._clients = threading.BoundedSemaphore(MOST_CLIENTS)
        self._watching = 0
        try:
            self._server = _Server((host, port), _handler(self))
        except OSError as error:
            raise LinkError(f"port {port} for the camera's stream: expected it free, found: {error.strerror}") from None
        self.port = int(self._server.server_address[1])
        self.url = f"http://{host}:{self.port}/camera"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True, name="mjpeg")
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether anybody watches."""
        return self._watching > 0

    def publish(self, image: Image, exposed_s: float) -> None:
        """Show a picture (height, width) to whoever watches; it costs nothing where nobody does.

        Args:
            image: gray.
            exposed_s: middle of its exposure, monotonic clock.
        """
        if not self.watched:
            return
        import cv2

        _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
        with self._changed:
            number = 1 if self._newest is None else self._newest[0] + 1
            self._newest = (number, data.tobytes(), exposed_s)
            self._changed.notify_all()

    def close(self) -> None:
        """Let all clients go and give the port back."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(CLIENT_TIMEOUT_S)

    def stream(self, client: _Handler) -> None:
        """Send pictures to one client until it goes."""
        with self._changed:
            self._watching += 1
        try:
            self._send_all(client)
        finally:
            with self._changed:
                self._watching -= 1

    def admitted(self) -> contextlib.AbstractContextManager[bool]:
        """Whether there is room for one more client; it is held meanwhile."""
        return _held(self._clients)

    def _send_all(self, client: _Handler) -> None:
        seen = 0 if self._newest is None else self._newest[0]
        while True:
            with self._changed:
                while not self._closed and (self._newest is None or self._newest[0] == seen):
                    self._changed.wait(_KEEP_WAITING_S)
                    if client.gone():
                        return
                if self._closed or self._newest is None:
                    return
                seen, data, exposed_s = self._newest
            head = (
                f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n"
                f"X-Timestamp: {exposed_s:.6f}\r\nX-Clock: monotonic\r\n\r\n"
            )
            client.wfile.write(head.encode() + data + b"\r\n")


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = 16

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Clients come and go as they like."""


class _Handler(http.server.BaseHTTPRequestHandler):
    timeout = CLIENT_TIMEOUT_S
    stream: MjpegServer

    def setup(self) -> None:
        self.request.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        super().setup()

    def do_GET(self) -> None:
        with self.stream.admitted() as admitted:
            if not admitted:
                self.send_error(http.HTTPStatus.SERVICE_UNAVAILABLE, "too many watch already")
                return
            self._send_head()
            self.stream.stream(self)

    def do_HEAD(self) -> None:
        self._send_head()

    def gone(self) -> bool:
        """Whether the client has closed its end."""
        try:
            readable, _, _ = select.select((self.connection,), (), (), 0.0)
            return bool(readable) and not self.connection.recv(4096)
        except (OSError, ValueError):
            return True

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""

    def _send_head(self) -> None:
        self.close_connection = True
        self.send_response(http.HTTPStatus.OK)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()


def _handler(stream: MjpegServer) -> type[_Handler]:
    return type("Handler", (_Handler,), {"stream": stream})


@contextlib.contextmanager
def _held(semaphore: threading.BoundedSemaphore) -> Any:
    admitted = semaphore.acquire(blocking=False)
    try:
        yield admitted
    finally:
        if admitted:
            semaphore.release()
