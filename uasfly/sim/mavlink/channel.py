"""UDP as PX4's onboard link uses it: telemetry to one known address, and to everybody who has talked to us lately."""

from __future__ import annotations

import errno
import heapq
import itertools
import socket
from collections.abc import Iterator

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from uasfly.errors import LinkError, shortened
from uasfly.sim.link_faults import LinkFaults
from uasfly.sim.mavlink.framing import FrameReader, Message
from uasfly.sim.mavlink.identity import Identity

Address = tuple[str, int]

DEFAULT_REMOTE: Address = ("127.0.0.1", 14540)
DEFAULT_LOCAL_PORT = 14580
RECEIVE_BUFFER = 1 << 20
MAX_DATAGRAM = 65535
MAX_GUESTS = 4
GUEST_TIMEOUT_S = 10.0


class _Peer:
    """One address that is sent to, with the sequence numbers it sees."""

    __slots__ = ("address", "heard_s", "packer")

    def __init__(self, address: Address, identity: Identity) -> None:
        self.address = address
        self.heard_s = 0.0
        self.packer = dialect.MAVLink(None, srcSystem=identity.system, srcComponent=identity.component)


class UdpChannel:
    """A bound UDP socket that speaks MAVLink 2.

    Args:
        remote: host and port that telemetry goes to from the start.
        local_port: port to send from and to listen on, 0 for any that is free.
        identity: ids that the frames carry.
        faults: what the link does to messages.

    Raises:
        LinkError: the remote host is unknown, or the local port is taken.

    Attributes:
        local_port: the bound port.
        frames: counts of frames received.
    """

    def __init__(self, remote: Address, local_port: int, identity: Identity, faults: LinkFaults | None = None) -> None:
        self._faults = faults or LinkFaults(np.random.default_rng(0))
        self._order = itertools.count()
        self._delayed_out: list[tuple[float, int, bytes, Address]] = []
        self._delayed_in: list[tuple[float, int, Message, Address]] = []
        self._now_s = 0.0
        self._identity = identity
        self._home = _Peer(_resolve(remote), identity)
        self._guests: dict[Address, _Peer] = {}
        self.frames = FrameReader()
        self._socket = _bound_socket(local_port, loopback=self._home.address[0].startswith("127."))
        self.local_port: int = self._socket.getsockname()[1]

    def fileno(self) -> int:
        """The socket's file descriptor, for select."""
        return self._socket.fileno()

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def receive(self, now_s: float, limit: int) -> Iterator[tuple[Message, Address]]:
        """Yield messages that have arrived, and where from, out of at most `limit` datagrams."""
        while self._delayed_in and self._delayed_in[0][0] <= now_s:
            _, _, message, address = heapq.heappop(self._delayed_in)
            yield message, address
        for _ in range(limit):
            try:
                datagram, address = self._socket.recvfrom(MAX_DATAGRAM)
            except OSError:  # nothing more, or an answer to something sent to a port where nobody listens
                return
            for message in self.frames.messages(datagram):
                self._heard(address, now_s)
                for delay_s in self._faults.command(message.get_type() == "SET_ATTITUDE_TARGET"):
                    if delay_s > 0.0:
                        heapq.heappush(self._delayed_in, (now_s + delay_s, next(self._order), message, address))
                    else:
                        yield message, address

    def send(self, message: Message, address: Address) -> None:
        """Send one message to one address (which must have been heard)."""
        peer = self._home if address == self._home.address else self._guests.get(address)
        if peer is not None:
            self._send(message, peer)

    def broadcast(self, messages: list[Message], now_s: float) -> None:
        """Send messages to everybody; guests that have been silent too long are forgotten."""
        for peer in self._guests.copy().values():
            if now_s - peer.heard_s > GUEST_TIMEOUT_S:
                del self._guests[peer.address]
        self._now_s = now_s
        while self._delayed_out and self._delayed_out[0][0] <= now_s:
            _, _, frame, address = heapq.heappop(self._delayed_out)
            self._put(frame, address)
        for rubbish in self._faults.garbage(now_s):
            self._put(rubbish, self._home.address)
        for message in messages:
            self._send(message, self._home)
            for peer in self._guests.values():
                self._send(message, peer)

    def _heard(self, address: Address, now_s: float) -> None:
        if address == self._home.address:
            return
        peer = self._guests.get(address)
        if peer is None:
            if len(self._guests) >= MAX_GUESTS:
                return
            peer = self._guests[address] = _Peer(address, self._identity)
        peer.heard_s = now_s

    def _send(self, message: Message, peer: _Peer) -> None:
        frame = message.pack(peer.packer)
        peer.packer.seq = (peer.packer.seq + 1) & 0xFF
        for delay_s in self._faults.telemetry():
            if delay_s > 0.0:
                heapq.heappush(self._delayed_out, (self._now_s + delay_s, next(self._order), frame, peer.address))
            else:
                self._put(frame, peer.address)

    def _put(self, data: bytes, address: Address) -> None:
        try:
            self._socket.sendto(data, address)
        except OSError:  # a full buffer or an unreachable network loses telemetry, as a radio does
            return


def _resolve(remote: Address) -> Address:
    try:
        return socket.gethostbyname(remote[0]), remote[1]
    except (OSError, UnicodeError) as error:  # the latter for a name that no host can have
        raise LinkError(
            f"cannot find the host {shortened(remote[0])!r} to send MAVLink to: {error}; use an IP address"
        ) from error


def _bound_socket(local_port: int, loopback: bool) -> socket.socket:
    host = "127.0.0.1" if loopback else "0.0.0.0"
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.setblocking(False)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    try:
        bound.bind((host, local_port))
    except OSError as error:
        bound.close()
        reason = "is in use by another program" if error.errno == errno.EADDRINUSE else f"cannot be used: {error}"
        raise LinkError(
            f"UDP port {local_port} of {host} {reason}; "
            "end the other vehicle, or choose another local port (0 takes any that is free)"
        ) from error
    return bound
