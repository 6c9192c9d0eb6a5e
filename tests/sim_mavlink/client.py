"""A MAVLink client on loopback for tests that need real sockets; every wait has a limit, none a fixed length."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from typing import Any, Self

from pymavlink.dialects.v20 import development as dialect

from uasfly.sim.mavlink.framing import FrameReader

Message = Any
PATIENCE_S = 20.0


class Client:
    """Listens on a free port of its own and talks to the vehicle's."""

    def __init__(self, system: int = 1, component: int = 191) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.port: int = self.socket.getsockname()[1]
        self.vehicle = ("127.0.0.1", 0)
        self.reader = FrameReader()
        self._packer = dialect.MAVLink(None, system, component)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, message: Message) -> None:
        """Send a message to the vehicle."""
        self.socket.sendto(message.pack(self._packer), self.vehicle)

    def command(self, number: int, *parameters: float) -> None:
        """Send a COMMAND_LONG."""
        seven = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *seven))

    def receive(self, wait_s: float) -> list[tuple[float, Message]]:
        """Messages that arrive within some time, with the time of their arrival."""
        received = []
        end = time.monotonic() + wait_s
        while (left := end - time.monotonic()) > 0.0:
            if select.select((self.socket,), (), (), left)[0]:
                datagram, _ = self.socket.recvfrom(65535)
                now = time.monotonic()
                received += [(now, message) for message in self.reader.messages(datagram)]
        return received

    def wait_for(self, name: str, fits: Callable[[Message], bool] = lambda _: True) -> Message:
        """The first message of a kind that fits; fails after `PATIENCE_S`."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            for _, message in self.receive(0.01):
                if message.get_type() == name and fits(message):
                    return message
        raise AssertionError(f"no {name} within {PATIENCE_S} s")
