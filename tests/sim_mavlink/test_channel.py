import socket
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.client import Client
from uasfly.errors import LinkError
from uasfly.sim.mavlink.channel import GUEST_TIMEOUT_S, MAX_GUESTS, UdpChannel
from uasfly.sim.mavlink.identity import Identity


def _beat() -> object:
    return dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)


@pytest.fixture
def home() -> Iterator[Client]:
    """The client that telemetry goes to from the start."""
    with Client() as client:
        yield client


@pytest.fixture
def channel(home: Client) -> Iterator[UdpChannel]:
    """A channel to it from a free port."""
    channel = UdpChannel(("127.0.0.1", home.port), 0, Identity(3))
    home.vehicle = ("127.0.0.1", channel.local_port)
    yield channel
    channel.close()


def _arrived(channel: UdpChannel, now_s: float = 0.0) -> list[str]:
    names: list[str] = []
    for _ in range(100):
        names += [message.get_type() for message, _ in channel.receive(now_s, 10)]
        if names:
            break
    return names


def test_a_busy_port_is_a_clear_error(channel: UdpChannel) -> None:
    """The text names the port and what to do."""
    with pytest.raises(LinkError, match=rf"UDP port {channel.local_port} .*in use.*choose another"):
        UdpChannel(("127.0.0.1", 15999), channel.local_port, Identity())


def test_an_unknown_host_is_a_clear_error() -> None:
    """The text names the host."""
    with pytest.raises(LinkError, match=r"cannot find the host 'no\.such\.host\.invalid'"):
        UdpChannel(("no.such.host.invalid", 15999), 0, Identity())


def test_telemetry_goes_to_the_remote_before_it_has_said_anything(channel: UdpChannel, home: Client) -> None:
    """Frames carry the vehicle's ids and count up without a gap."""
    channel.broadcast([_beat()] * 300, 0.0)
    received = [message for _, message in home.receive(0.2)]
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in received} == {(3, 1)}
    assert [m.get_seq() for m in received] == [i % 256 for i in range(300)]


def test_who_talks_to_the_vehicle_is_answered_and_gets_telemetry(channel: UdpChannel, home: Client) -> None:
    """A second client, for example a ground station, joins by sending a valid frame, with its own sequence."""
    channel.broadcast([_beat()] * 5, 0.0)
    with Client() as guest:
        guest.vehicle = home.vehicle
        guest.send(_beat())
        (_, address) = next(iter(_until_heard(channel)))
        channel.broadcast([_beat()], 1.0)
        channel.send(_beat(), address)
        assert [m.get_seq() for _, m in guest.receive(0.1)] == [0, 1]
    assert len(home.receive(0.1)) == 6


def _until_heard(channel: UdpChannel) -> list[tuple[object, tuple[str, int]]]:
    for _ in range(1000):
        if heard := list(channel.receive(0.0, 10)):
            return heard
    raise AssertionError("nothing arrived")


def test_garbage_makes_no_guest(channel: UdpChannel, home: Client) -> None:
    """Only valid frames are talked back to."""
    with Client() as stranger:
        stranger.socket.sendto(b"\xfd\xff\x00 no frame", home.vehicle)
        assert _arrived(channel) == []
        channel.broadcast([_beat()], 0.0)
        assert stranger.receive(0.05) == []
    assert channel.frames.bad > 0


def test_silent_guests_are_forgotten(channel: UdpChannel, home: Client) -> None:
    """After ten seconds without a frame a guest gets nothing more; the remote always does."""
    with Client() as guest:
        guest.vehicle = home.vehicle
        guest.send(_beat())
        assert _arrived(channel) == ["HEARTBEAT"]
        channel.broadcast([_beat()], GUEST_TIMEOUT_S - 0.1)
        channel.broadcast([_beat()], GUEST_TIMEOUT_S + 0.1)
        assert len(guest.receive(0.1)) == 1
    assert len(home.receive(0.1)) == 2


def test_the_number_of_guests_is_limited(channel: UdpChannel, home: Client) -> None:
    """A flood of addresses does not multiply the traffic."""
    guests = [Client() for _ in range(MAX_GUESTS + 2)]
    for guest in guests:
        guest.vehicle = home.vehicle
        guest.send(_beat())
        _arrived(channel)
    channel.broadcast([_beat()], 0.0)
    assert sum(len(guest.receive(0.05)) for guest in guests) == MAX_GUESTS
    for guest in guests:
        guest.socket.close()


def test_sending_where_nobody_listens_is_harmless() -> None:
    """A vehicle may be up before its companion, and outlive it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    channel = UdpChannel(("127.0.0.1", port), 0, Identity())
    for _ in range(5):
        channel.broadcast([_beat()], 0.0)
        assert _arrived(channel) == []
    channel.close()


def test_a_closed_channel_frees_its_port(channel: UdpChannel) -> None:
    """The next vehicle can have the port at once."""
    channel.close()
    again = UdpChannel(("127.0.0.1", 15999), channel.local_port, Identity())
    again.close()
