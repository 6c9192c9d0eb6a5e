"""Fixtures and waiting helpers of the link's tests."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest_asyncio

from tests.link.fake_vehicle import FakeVehicle
from tests.link.waiting import Pair
from tests.link.wires import UdpWire
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port


@pytest_asyncio.fixture
async def pair() -> AsyncIterator[Pair]:
    """A connected link and the vehicle at its other end, which has system id 7."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), system_id=7) as vehicle:
        async with await MavsdkLink.connect(f"udp://127.0.0.1:{port}", want_truth=True) as link:
            yield link, vehicle
