"""From a URL to a bridge that is attached to the vehicle, or to an error that says what to check."""

from __future__ import annotations

import asyncio
import socket
from dataclasses import replace

from uasfly.errors import LinkError, shortened
from uasfly.link.bridge import Bridge, HeardSystem
from uasfly.link.ports import check_available
from uasfly.link.urls import ConnectionUrl

FIRST_SYSTEM_ID = 1  # PX4's default, tried first
SECOND_SEARCH_S = 5.0  # for a vehicle that has just been heard

_CHECKS = {
    "udpin": "does it send to this computer and this port (MAV_2_REMOTE_PRT, a firewall)?",
    "udpout": "does it listen on this port?",
    "tcpin": "does it connect to this port?",
    "tcpout": "does it accept connections there?",
    "serial": "is the baud rate the vehicle's (SER_TEL2_BAUD), is MAVLink on for that port (MAV_1_CONFIG)?",
}


async def find_vehicle(
    url: ConnectionUrl, system_id: int | None, timeout_s: float
) -> tuple[Bridge, ConnectionUrl, list[HeardSystem]]:
    """Open the connection and wait for the vehicle.

    PX4 relays texts and counts computers of its own system only, and MAVSDK cannot change its own system id later:
    where the vehicle's id is not the expected one, the connection is opened a second time with it.

    Args:
        url: where to look.
        system_id: the vehicle wanted, None for the first one heard.
        timeout_s: how long to wait.

    Returns:
        The attached bridge, the URL with its host as a number, and the systems heard.

    Raises:
        LinkError: host unknown, port busy, nobody there, another system id, or not a PX4.
    """
    url = await _with_numeric_host(url)
    check_available(url)
    left_s = timeout_s
    own_id = system_id or FIRST_SYSTEM_ID
    while True:
        bridge = Bridge(str(url), own_id)
        try:
            heard = await bridge.find(system_id, left_s)
            if not bridge.attached:
                raise LinkError(_nobody(url, system_id, timeout_s, heard))
        except BaseException:
            bridge.close()
            raise
        if bridge.system_id == own_id:
            return bridge, url, heard
        bridge.close()
        own_id = system_id = bridge.system_id
        left_s = SECOND_SEARCH_S


def refuse_several(url: ConnectionUrl, heard: list[HeardSystem]) -> None:
    """Refuse to choose between vehicles.

    Raises:
        LinkError: when more than one of the systems heard is a vehicle; the text lists them.
    """
    vehicles = [str(system) for system in sorted(heard, key=lambda system: system.system_id) if system.autopilot]
    if len(vehicles) > 1:
        raise LinkError(
            f"{url}: expected one vehicle, heard {len(vehicles)}: {', '.join(vehicles)}. "
            "Say which one is meant with --system-id, or give each a port of its own"
        )


async def _with_numeric_host(url: ConnectionUrl) -> ConnectionUrl:
    """MAVSDK wants a numeric host."""
    if url.scheme == "serial":
        return url
    try:
        found = await asyncio.get_running_loop().getaddrinfo(url.host, url.port, family=socket.AF_INET)
    except (OSError, UnicodeError) as error:  # the latter for a name that no host can have
        reason = error.strerror if isinstance(error, OSError) else "no host can have this name"
        raise LinkError(f"{url}: no host {shortened(url.host)!r} is known ({reason})") from error
    return replace(url, host=str(found[0][4][0]))


def _nobody(url: ConnectionUrl, system_id: int | None, timeout_s: float, heard: list[HeardSystem]) -> str:
    systems = ", ".join(str(system) for system in heard)
    foreign = [system for system in heard if system.autopilot and system_id in {None, system.system_id}]
    if foreign:
        return f"{url}: system {foreign[0]} is not a PX4 vehicle, and uasfly speaks PX4's modes only"
    if system_id is not None and any(system.autopilot for system in heard):
        return (
            f"{url}: no vehicle with system id {system_id} within {timeout_s:g} s; heard {systems}. "
            "Ask for one of these, or set MAV_SYS_ID on the vehicle"
        )
    only = f"heard only {systems}; " if heard else ""
    return f"{url}: no vehicle within {timeout_s:g} s; {only}is it powered, and {_CHECKS[url.scheme]}"
