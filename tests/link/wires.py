"""Connections between the fake vehicle and the link: UDP, TCP and a pseudo terminal."""

from __future__ import annotations

import contextlib
import os
import select
import socket
from typing import Protocol


class Wire(Protocol):
    """One end of a connection: a file descriptor with `read` and `write`."""

    def fileno(self) -> int:
        """File descriptor that becomes readable when something has come."""
        ...

    def read(self) -> bytes:
        """What has come."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes."""
        ...

    def close(self) -> None:
        """Close for good."""
        ...


class UdpWire:
    """Sends to a port of this computer, and to whoever writes to it."""

    def __init__(self, port: int = 0, listen_port: int = 0) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", listen_port))
        self._peer = ("127.0.0.1", port) if port else None

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._socket.getsockname()[1])

    def fileno(self) -> int:
        """File descriptor that becomes readable when something has come."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """What has come."""
        data, peer = self._socket.recvfrom(4096)
        self._peer = self._peer or peer
        return data

    def write(self, data: bytes) -> None:
        """Send bytes."""
        if self._peer is not None:
            self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Close for good."""
        self._socket.close()


class TcpWire:
    """Accepts one connection."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._connection: socket.socket | None = None

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._listener.getsockname()[1])

    def fileno(self) -> int:
        """File descriptor that becomes readable when something has come."""
        return (self._connection or self._listener).fileno()

    def read(self) -> bytes:
        """What has come."""
        if self._connection is None:
            self._connection, _ = self._listener.accept()
            return b""
        return self._connection.recv(4096)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        if self._connection is not None:
            with contextlib.suppress(OSError):  # the link has closed its end
                self._connection.sendall(data)

    def close(self) -> None:
        """Close for good."""
        if self._connection is not None:
            self._connection.close()
        self._listener.close()


class TcpClientWire:
    """Connects to a port of this computer as soon as somebody listens there."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._socket = socket.socket()

    def fileno(self) -> int:
        """File descriptor that becomes readable when something has come."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """What has come."""
        return self._socket.recv(4096)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._socket.sendall(data)
        except OSError:  # not connected yet, or no more
            self._socket.close()
            self._socket = socket.socket()
            with contextlib.suppress(OSError):
                self._socket.connect(("127.0.0.1", self._port))

    def close(self) -> None:
        """Close for good."""
        self._socket.close()


class SerialWire:
    """The vehicle's end of a pseudo terminal; the link opens `device`."""

    def __init__(self) -> None:
        self._vehicle, self._link = os.openpty()
        self.device = os.ttyname(self._link)

    def fileno(self) -> int:
        """File descriptor that becomes readable when something has come."""
        return self._vehicle

    def read(self) -> bytes:
        """What has come."""
        return os.read(self._vehicle, 4096)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        if select.select([], [self._vehicle], [], 0.0)[1]:  # nobody may be reading yet
            os.write(self._vehicle, data)

    def close(self) -> None:
        """Close for good."""
        os.close(self._vehicle)
        os.close(self._link)
