"""Serial devices that go and come back."""

from __future__ import annotations

from pathlib import Path

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
