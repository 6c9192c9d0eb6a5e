"""Serial devices that go and come back, and ports that are free."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from uasfly.errors import LinkError
from uasfly.link import ports
from uasfly.link.ports import DeviceWatch


def test_a_device_that_stays_is_not_replaced(tmp_path: Path) -> None:
    """However often it is looked at."""
    device = tmp_path / "tty"
    device.touch()
    watch = DeviceWatch(str(device))
    assert not watch.replaced()
    assert not watch.replaced()


def test_a_device_that_was_pulled_is_replaced_when_it_is_back(tmp_path: Path) -> None:
    """Not while it is away; then until it has been opened. The same device put in again counts too."""
    device, away = tmp_path / "tty", tmp_path / "away"
    device.touch()
    watch = DeviceWatch(str(device))
    device.rename(away)
    assert not watch.replaced()
    away.rename(device)
    assert watch.replaced()
    assert watch.replaced()
    watch.opened()
    assert not watch.replaced()


def test_another_device_under_the_name_is_replaced(tmp_path: Path) -> None:
    """Exchanged between two looks."""
    device, other = tmp_path / "tty", tmp_path / "other"
    device.touch()
    other.touch()
    watch = DeviceWatch(str(device))
    other.replace(device)
    assert watch.replaced()


def test_a_free_port_is_none_that_another_program_gets_by_chance() -> None:
    """It can be opened, and lies outside of what the system hands out to sockets that ask for no port."""
    port = ports.free_udp_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken, socket.socket(socket.AF_INET) as any_port:
        taken.bind(("127.0.0.1", port))
        any_port.bind(("127.0.0.1", 0))
        assert any_port.getsockname()[1] not in ports.FREE_PORTS


def test_a_port_that_is_taken_is_not_given_and_none_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two ports the one that nobody has; of one that somebody has, none."""
    first = next(port for port in ports.FREE_PORTS if port > ports.free_udp_port())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", first))
        monkeypatch.setattr(ports, "FREE_PORTS", range(first, first + 2))
        monkeypatch.setattr(ports, "ATTEMPTS", 2)
        assert ports.free_udp_port() == first + 1
        monkeypatch.setattr(ports, "FREE_PORTS", range(first, first + 1))
        monkeypatch.setattr(ports, "ATTEMPTS", 1)
        with pytest.raises(LinkError, match="no free UDP port"):
            ports.free_udp_port()
