"""Whether a port can be opened, asked before MAVSDK gets it: it shares a busy one without a word. And a free one."""

from __future__ import annotations

import errno
import os
import socket
from pathlib import Path
from random import SystemRandom

from uasfly.errors import LinkError
from uasfly.link.urls import ConnectionUrl

# Below what systems hand out to sockets that ask for no port of their own (Linux from 32768, others from 49152):
# of those another program may have got one before it is opened here.
FREE_PORTS = range(20000, 32000)
ATTEMPTS = 100


def free_udp_port() -> int:
    """A UDP port on loopback that nobody has just now, nor gets by chance.

    Raises:
        LinkError: when none is found.
    """
    for port in SystemRandom().sample(FREE_PORTS, ATTEMPTS):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise LinkError(f"no free UDP port between {FREE_PORTS.start} and {FREE_PORTS.stop}: end other programs")


def check_available(url: ConnectionUrl) -> None:
    """Make sure that nobody else holds the port or device of `url`.

    Raises:
        LinkError: saying what holds or hides it and what to do.
    """
    if url.listens:
        _check_bind(url)
    elif url.scheme == "serial":
        _check_device(url)


class DeviceWatch:
    """Notices that a serial device has been replaced since it was opened: pulled and put in again, or re-enumerated.

    Only then is its connection to be opened anew: each opening leaves a dead connection behind, see `Bridge.reopen`.
    """

    def __init__(self, device: str) -> None:
        self._device = Path(device)
        self._opened = self._identity()

    def replaced(self) -> bool:
        """Whether another device is there now; False while there is none."""
        now = self._identity()
        if now is None:
            self._opened = None
        return now is not None and now != self._opened

    def opened(self) -> None:
        """The device that is there now has been opened."""
        self._opened = self._identity()

    def _identity(self) -> tuple[int, ...] | None:
        try:
            found = self._device.stat()
        except OSError:
            return None
        return found.st_dev, found.st_ino, found.st_rdev


def _check_bind(url: ConnectionUrl) -> None:
    kind = socket.SOCK_DGRAM if url.scheme == "udpin" else socket.SOCK_STREAM
    with socket.socket(socket.AF_INET, kind) as probe:
        if url.scheme == "tcpin":  # a connection closed a minute ago does not make the port busy
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((url.host, url.port))
        except OSError as error:
            raise LinkError(f"{url}: {_bind_problem(url, error)}") from error


def _bind_problem(url: ConnectionUrl, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {url.port} is busy: another program listens there (another uasfly, a ground station, MAVROS?). "
            f"Stop it (`ss -lunp | grep {url.port}` shows which it is) or use another port"
        )
    if error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
        return (
            f"{url.host} is not an address of this computer; "
            f"listen on 0.0.0.0, or use {url.scheme[:3]}out to send to a vehicle"
        )
    if error.errno in {errno.EACCES, errno.EPERM}:
        return f"port {url.port} may not be opened by this user; use a port above 1023"
    return f"the port cannot be opened: {error.strerror or error}"


def _check_device(url: ConnectionUrl) -> None:
    if not Path(url.device).exists():
        patterns = ("ttyACM*", "ttyUSB*", "ttyAMA*")
        ports = sorted(str(path) for pattern in patterns for path in Path("/dev").glob(pattern))
        found = f"serial ports here: {', '.join(ports)}" if ports else "no serial port is there"
        raise LinkError(f"{url}: {url.device} does not exist; {found}. Is the cable in, is the vehicle powered?")
    try:
        descriptor = os.open(url.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except PermissionError as error:
        raise LinkError(
            f"{url}: this user may not open {url.device}; `sudo usermod -aG dialout $USER`, then log in again"
        ) from error
    except OSError as error:
        busy = "another program holds it" if error.errno == errno.EBUSY else error.strerror
        raise LinkError(f"{url}: {url.device} cannot be opened: {busy}") from error
    os.close(descriptor)
