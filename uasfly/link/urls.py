"""Connection URLs: what a user may write, and what MAVSDK is given."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, cast

from uasfly.errors import LinkError, shortened

Scheme = Literal["udpin", "udpout", "tcpin", "tcpout", "serial"]

DEFAULT_UDP_PORT = 14540  # PX4's onboard link
DEFAULT_TCP_PORT = 5760
USB_BAUD = 57600  # USB ignores it, MAVSDK wants one

ACCEPTED_FORMS = """accepted forms:
  udpin://0.0.0.0:14540              listen for a vehicle (also udp://:14540)
  udpout://192.168.1.10:14580        send to a vehicle that listens
  tcpout://192.168.1.10:5760         connect to a vehicle's TCP server (also tcp://host:port)
  tcpin://0.0.0.0:5760               wait for a vehicle to connect
  serial:///dev/ttyACM0:921600       serial port and baud rate (also /dev/ttyACM0:921600)"""

_NETWORK = re.compile(r"^(?P<scheme>[a-z]+):(?://)?(?:@)?(?P<host>[^:/@\s]*)(?::(?P<port>[^:/\s]*))?/?$", re.IGNORECASE)
_SERIAL = re.compile(r"^(?:serial:(?://)?(?=/)|(?=/dev/))(?P<device>/[^:\s]+)(?::(?P<baud>[^:\s]*))?$", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class ConnectionUrl:
    """A connection to a vehicle; `device` and `baud` belong to serial, `host` and `port` to the others."""

    scheme: Scheme
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    def __str__(self) -> str:
        """The form that MAVSDK understands."""
        if self.scheme == "serial":
            return f"serial://{self.device}:{self.baud}"
        return f"{self.scheme}://{self.host}:{self.port}"

    @property
    def listens(self) -> bool:
        """Whether this end binds a port and waits."""
        return self.scheme in {"udpin", "tcpin"}


def parse_url(text: str) -> ConnectionUrl:
    """Read a connection URL in any of the accepted forms.

    A plain `udp://` listens when its host is empty, 0.0.0.0 or local, and sends otherwise, as ground stations do it.

    Raises:
        LinkError: naming what is wrong with `text` and the accepted forms.
    """
    text = text.strip()
    serial = _SERIAL.match(text)
    if serial:
        return _serial(text, serial["device"], serial["baud"])
    network = _NETWORK.match(text)
    if not network:
        raise _wrong(text, "it has none of the accepted forms")
    scheme, host = network["scheme"].lower(), network["host"]
    if scheme not in {"udp", "udpin", "udpout", "tcp", "tcpin", "tcpout"}:
        raise _wrong(text, f"the scheme {shortened(scheme)!r} is not known")
    if not network["port"] and host.isdigit():  # udp:14540
        host, port_text = "", host
    else:
        port_text = network["port"] or ""
    default = DEFAULT_UDP_PORT if scheme.startswith("udp") else DEFAULT_TCP_PORT
    port = _number(text, "port", port_text, 1, 65535) if port_text else default
    if scheme == "udp":
        scheme = "udpin" if host in {"", "0.0.0.0", "localhost"} or host.startswith("127.") else "udpout"
    elif scheme == "tcp":
        scheme = "tcpout"
    if scheme.endswith("out") and host in {"", "0.0.0.0"}:
        raise _wrong(text, f"{scheme} needs the host to send to")
    host = "127.0.0.1" if host == "localhost" else host or "0.0.0.0"
    return ConnectionUrl(cast(Scheme, scheme), host=host, port=port)


def _serial(text: str, device: str, baud_text: str | None) -> ConnectionUrl:
    if baud_text:
        baud = _number(text, "baud rate", baud_text, 1200, 4_000_000)
    elif "ACM" in device:
        baud = USB_BAUD
    else:
        raise _wrong(text, "a serial port needs its baud rate, as set on the vehicle (SER_TEL2_BAUD or its like)")
    return ConnectionUrl("serial", device=device, baud=baud)


def _number(text: str, what: str, number: str, low: int, high: int) -> int:
    if not re.fullmatch("[0-9]{1,7}", number) or not low <= int(number) <= high:  # "²" is a digit too, to Python
        raise _wrong(text, f"the {what} must be a number in {low}..{high}, found {shortened(number)!r}")
    return int(number)


def _wrong(text: str, reason: str) -> LinkError:
    return LinkError(f"connection URL {shortened(text)!r}: {reason}\n{ACCEPTED_FORMS}")
