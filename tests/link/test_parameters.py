"""Reading parameters: what a value means, repeats, several at a time; and home."""

from __future__ import annotations

import asyncio
import json
import math
import struct
from typing import Any

import numpy as np
import pytest

from tests.link.fake_vehicle import FakeVehicle
from tests.link.test_commands import Wire
from tests.link.waiting import Pair, arrived
from tests.link.wires import UdpWire
from uasfly.errors import LinkError
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.parameters import READS, READS_IN_FLIGHT, ParameterChannel, parameter_value
from uasfly.link.ports import free_udp_port

INTERVAL_S = 0.02
REAL32 = 9


def _told(name: str, value: float | None, kind: int = REAL32) -> dict[str, Any]:
    return {"param_id": name, "param_value": value, "param_type": kind}


def _bytes_as_float(layout: str, value: int) -> float:
    return float(struct.unpack("<f", struct.pack(layout, value).ljust(4, b"\0"))[0])


@pytest.mark.parametrize(
    ("kind", "layout", "value"),
    [(1, "<B", 200), (2, "<b", 100), (3, "<H", 60000), (4, "<h", 1234), (5, "<I", 3_000_000_000), (6, "<i", 5)],
)
def test_integers_are_read_from_the_bytes_of_the_float(kind: int, layout: str, value: int) -> None:
    """Every integer type of MAV_PARAM_TYPE, as PX4 packs it."""
    assert parameter_value(_told("X", _bytes_as_float(layout, value), kind)) == value


def test_small_negative_integers_of_few_bytes_are_read_too() -> None:
    """Their bytes are a tiny float; four bytes of a small negative number would be no number at all."""
    assert parameter_value(_told("X", _bytes_as_float("<b", -3), 2)) == -3.0
    assert parameter_value(_told("X", _bytes_as_float("<h", -300), 4)) == -300.0
    assert math.isnan(_bytes_as_float("<i", -1))


def test_floats_are_as_they_are_and_what_is_no_number_is_none() -> None:
    """MAVSDK gives null for NaN and infinity; a value without a type is a float."""
    assert parameter_value(_told("X", 0.25)) == 0.25
    assert parameter_value({"param_id": "X", "param_value": 1.5}) == 1.5
    for wrong in (None, math.nan, math.inf):
        assert parameter_value(_told("X", wrong)) is None
        assert parameter_value(_told("X", wrong, 6)) is None


def test_recorded_values_of_px4() -> None:
    """COM_OBL_RC_ACT 5 and EKF2_GPS_CTRL 7 in the recording, as floats of its log."""
    assert parameter_value(_told("COM_OBL_RC_ACT", 7.006492321624085e-45, 6)) == 5.0
    assert parameter_value(_told("EKF2_GPS_CTRL", 9.80908925027372e-45, 6)) == 7.0


async def test_a_read_is_asked_until_it_is_answered() -> None:
    """By name, with an index that says so; another parameter's value and one that is no number do not count."""
    wire = Wire()
    channel = ParameterChannel(wire.send, 1, read_interval_s=INTERVAL_S)
    task = asyncio.create_task(channel.read(["COM_OF_LOSS_T"]))
    await arrived(lambda: len(wire.sent) >= 2)
    channel.receive(_told("COM_RC_IN_MODE", 1.0))
    channel.receive(_told("COM_OF_LOSS_T", None))
    channel.receive(_told("COM_OF_LOSS_T", 0.5))
    assert await task == {"COM_OF_LOSS_T": 0.5}
    asked = {(message["name"], message["param_id"], message["param_index"]) for message in wire.sent}
    assert asked == {("PARAM_REQUEST_READ", "COM_OF_LOSS_T", -1)}


async def test_what_is_not_answered_is_none_after_three_tries() -> None:
    """The others are there all the same, in the order that was asked, each once."""
    wire = Wire()

    def send(name: str, fields: str) -> None:
        wire.send(name, fields)
        asked = json.loads(fields)["param_id"]
        if asked != "NO_SUCH_PARAM":
            asyncio.get_running_loop().call_soon(channel.receive, _told(asked, 2.0))

    channel = ParameterChannel(send, 1, read_interval_s=INTERVAL_S)
    values = await channel.read(["B", "NO_SUCH_PARAM", "A", "B"])
    assert list(values.items()) == [("B", 2.0), ("NO_SUCH_PARAM", None), ("A", 2.0)]
    names = [message["param_id"] for message in wire.sent]
    assert (names.count("NO_SUCH_PARAM"), names.count("A"), names.count("B")) == (READS, 1, 1)


async def test_only_so_many_are_asked_at_a_time() -> None:
    """A slow link is not flooded: the next one goes out when one has been answered."""
    wire = Wire()
    channel = ParameterChannel(wire.send, 1, read_interval_s=100.0)
    task = asyncio.create_task(channel.read([f"P{k}" for k in range(READS_IN_FLIGHT + 3)]))
    await asyncio.sleep(0.05)
    assert len(wire.sent) == READS_IN_FLIGHT
    channel.receive(_told("P0", 1.0))
    await arrived(lambda: len(wire.sent) == READS_IN_FLIGHT + 1)
    for k in range(1, READS_IN_FLIGHT + 3):
        await arrived(lambda k=k: any(message["param_id"] == f"P{k}" for message in wire.sent))  # type: ignore[misc]
        channel.receive(_told(f"P{k}", float(k)))
    assert set((await task).values()) == {1.0, *map(float, range(2, READS_IN_FLIGHT + 3))}


async def test_parameters_come_over_the_link(pair: Pair) -> None:
    """Floats, integers whose bytes are a denormal float, large ones; a negative one reads as unknown, like none."""
    link, vehicle = pair
    vehicle.parameters |= {"MPC_THR_HOVER": 0.34, "COM_OBL_RC_ACT": 5, "EKF2_NOAID_TOUT": 5_000_000, "MINUS": -1}
    values = await link.read_parameters(["MPC_THR_HOVER", "COM_OBL_RC_ACT", "EKF2_NOAID_TOUT", "MINUS", "NO_SUCH"])
    assert values.pop("MPC_THR_HOVER") == pytest.approx(0.34)
    assert values == {"COM_OBL_RC_ACT": 5.0, "EKF2_NOAID_TOUT": 5e6, "MINUS": None, "NO_SUCH": None}


async def test_home_comes_over_the_link(pair: Pair) -> None:
    """East, north, up from north, east, down; the newest counts."""
    link, vehicle = pair
    vehicle.home_ned = (2.0, 5.0, -1.5)
    np.testing.assert_allclose(await link.home(), (5.0, 2.0, 1.5))  # type: ignore[arg-type]
    vehicle.home_ned = (0.0, 0.0, 0.0)
    np.testing.assert_allclose(await link.home(), np.zeros(3))  # type: ignore[arg-type]


@pytest.mark.parametrize("home", [None, (math.nan, 0.0, 0.0)])
async def test_home_that_is_not_told_is_none(pair: Pair, home: tuple[float, float, float] | None) -> None:
    """Silence, or numbers that are none."""
    link, vehicle = pair
    vehicle.home_ned = home
    assert await link.home() is None


async def test_a_closed_link_reads_nothing() -> None:
    """An error rather than a wait."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)):
        link = await MavsdkLink.connect(f"udpin://127.0.0.1:{port}")
        await link.close()
        with pytest.raises(LinkError, match="closed"):
            await link.read_parameters(["COM_OF_LOSS_T"])
