"""Connection URLs: accepted forms and clear errors."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from uasfly.errors import LinkError
from uasfly.link.ports import check_available
from uasfly.link.urls import ACCEPTED_FORMS, parse_url


@pytest.mark.parametrize(
    ("text", "mavsdk"),
    [
        ("udpin://0.0.0.0:14540", "udpin://0.0.0.0:14540"),
        ("udp://:14540", "udpin://0.0.0.0:14540"),
        ("udp://", "udpin://0.0.0.0:14540"),
        ("udp:14541", "udpin://0.0.0.0:14541"),
        ("udp://@:14540", "udpin://0.0.0.0:14540"),
        ("udp://127.0.0.1:14540", "udpin://127.0.0.1:14540"),
        ("udpin:0.0.0.0:14540", "udpin://0.0.0.0:14540"),
        ("UDP://192.168.1.10:14580", "udpout://192.168.1.10:14580"),
        ("udpout://localhost:14580", "udpout://127.0.0.1:14580"),
        ("tcp://10.0.0.5", "tcpout://10.0.0.5:5760"),
        ("tcpout://10.0.0.5:5762/", "tcpout://10.0.0.5:5762"),
        ("tcpin://0.0.0.0:5760", "tcpin://0.0.0.0:5760"),
        ("serial:///dev/ttyACM0:921600", "serial:///dev/ttyACM0:921600"),
        ("/dev/ttyUSB0:57600", "serial:///dev/ttyUSB0:57600"),
        ("serial:/dev/ttyACM0", "serial:///dev/ttyACM0:57600"),
        (
            "serial:///dev/serial/by-id/usb-Auterion_PX4-if00:115200",
            "serial:///dev/serial/by-id/usb-Auterion_PX4-if00:115200",
        ),
        (" udpin://0.0.0.0:14540\n", "udpin://0.0.0.0:14540"),
    ],
)
def test_friendly_forms_become_what_mavsdk_understands(text: str, mavsdk: str) -> None:
    """Missing hosts and ports are filled in; a plain udp listens on this computer and sends to another."""
    assert str(parse_url(text)) == mavsdk
    assert str(parse_url(mavsdk)) == mavsdk


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "none of the accepted forms"),
        ("14540", "none of the accepted forms"),
        ("http://0.0.0.0:14540", "scheme 'http'"),
        ("udpin://0.0.0.0:port", "port must be a number in 1..65535, found 'port'"),
        ("udpin://0.0.0.0:70000", "found '70000'"),
        ("udpout://:14580", "needs the host"),
        ("tcp://:5760", "needs the host"),
        ("serial:///dev/ttyUSB0", "baud rate"),
        ("/dev/ttyUSB0:fast", "baud rate must be a number"),
        ("udpin://0.0.0.0:14540:1", "none of the accepted forms"),
        ("udpin://0.0.0.0:²", "found '²'"),
        ("udpin://0.0.0.0:" + "9" * 5000, "must be a number in 1..65535"),
        ("/dev/ttyUSB0:²", "baud rate must be a number"),
    ],
)
def test_a_wrong_url_names_the_fault_and_the_accepted_forms(text: str, problem: str) -> None:
    """One error for the user: what is wrong, and every form that would be right."""
    with pytest.raises(LinkError) as caught:
        parse_url(text)
    assert problem in str(caught.value)
    assert ACCEPTED_FORMS in str(caught.value)


def test_a_listening_port_is_checked_without_being_kept() -> None:
    """A free port passes twice, a taken one fails while it is taken; UDP and TCP alike."""
    for kind, scheme in ((socket.SOCK_DGRAM, "udpin"), (socket.SOCK_STREAM, "tcpin")):
        with socket.socket(socket.AF_INET, kind) as taken:
            taken.bind(("127.0.0.1", 0))
            if kind == socket.SOCK_STREAM:
                taken.listen()
            url = parse_url(f"{scheme}://127.0.0.1:{taken.getsockname()[1]}")
            with pytest.raises(LinkError, match="is busy"):
                check_available(url)
        check_available(url)
        check_available(url)


def test_a_foreign_address_cannot_be_listened_on() -> None:
    """The error proposes what was probably meant."""
    with pytest.raises(LinkError, match=r"not an address of this computer.*udpout"):
        check_available(parse_url("udpin://192.0.2.1:14540"))


def test_a_missing_serial_port_is_named(tmp_path: Path) -> None:
    """With a hint about the cable and the ports that are there."""
    with pytest.raises(LinkError, match=r"does not exist.*cable"):
        check_available(parse_url(f"serial://{tmp_path}/ttyNone:57600"))
