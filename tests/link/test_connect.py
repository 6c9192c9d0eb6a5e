"""Opening a connection: what is found, and what each failure tells the user."""

from __future__ import annotations

import asyncio
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from mavsdk import System

from tests.link.fake_vehicle import ARDUPILOT, GROUND_STATION, FakeVehicle
from tests.link.waiting import PATIENCE_S, arrived, texts, until
from tests.link.wires import SerialWire, TcpClientWire, TcpWire, UdpWire
from uasfly.errors import LinkError
from uasfly.link import bridge, upkeep
from uasfly.link.bridge import HeardSystem
from uasfly.link.finding import refuse_several
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import check_available, free_udp_port
from uasfly.link.urls import parse_url
from uasfly.messages import OdometrySample, Request, RequestKind

INVALID_AUTOPILOT = 8


async def sees_odometry(link: MavsdkLink) -> bool:
    """Whether position samples come."""
    return bool(await until(link, lambda got: any(isinstance(sample, OdometrySample) for sample in got)))


async def test_a_busy_port_is_named_before_mavsdk_gets_it() -> None:
    """MAVSDK would share the port silently and both programs would lose messages."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(LinkError, match=rf"port {port} is busy.*another program"):
            await MavsdkLink.connect(f"udpin://127.0.0.1:{port}")


async def test_two_links_on_one_port_are_refused() -> None:
    """The second uasfly on a port is told so, although MAVSDK binds in a way that would let it share."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)):
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}"):
            with pytest.raises(LinkError, match="busy"):
                await MavsdkLink.connect(f"udpin://127.0.0.1:{port}")


async def test_nobody_there_says_what_to_check() -> None:
    """Within the time-out, with the address and a hint that fits the kind of connection."""
    with pytest.raises(LinkError, match=r"no vehicle within 0.3 s; is it powered, and does it send to this computer"):
        await MavsdkLink.connect(f"udpin://127.0.0.1:{free_udp_port()}", timeout_s=0.3)


async def test_a_ground_station_alone_is_no_vehicle() -> None:
    """Heartbeats without an autopilot are reported as what they are."""
    port = free_udp_port()
    ground_station = FakeVehicle(UdpWire(port), 255, INVALID_AUTOPILOT, GROUND_STATION, component_id=190)
    with ground_station, pytest.raises(LinkError, match=r"no vehicle within 1.5 s; heard only 255 \(no autopilot\)"):
        await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", timeout_s=1.5)


async def test_a_wrong_system_id_lists_those_heard() -> None:
    """The error names the vehicle that is there."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), system_id=4), pytest.raises(LinkError, match=r"system id 2 .*heard 4 \(PX4\)"):
        await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", system_id=2, timeout_s=1.5)


async def test_another_autopilot_is_refused() -> None:
    """ArduPilot's custom modes mean other things."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), autopilot=ARDUPILOT), pytest.raises(LinkError, match="not a PX4"):
        await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", timeout_s=5.0)


async def test_the_wanted_one_of_two_vehicles_is_taken() -> None:
    """Two vehicles send to one port: the system id decides, and only its samples and answers count."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), system_id=1) as other, FakeVehicle(UdpWire(port), system_id=2) as wanted:
        other.position_ned, wanted.position_ned = (0.0, 0.0, -50.0), (0.0, 0.0, -2.0)
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", system_id=2) as link:
            samples = await until(link, lambda got: sum(isinstance(s, OdometrySample) for s in got) > 10)
            heights = {s.position_in_world[2] for s in samples if isinstance(s, OdometrySample)}
            assert heights == {2.0}


async def test_two_vehicles_without_a_system_id_are_refused_and_listed() -> None:
    """Which of them is flown must not be up to whose heartbeat comes first."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port), system_id=3), FakeVehicle(UdpWire(port), system_id=4):
        with pytest.raises(LinkError, match=r"expected one vehicle, heard 2: 3 \(PX4\), 4 \(PX4\).*--system-id"):
            await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", listen_s=PATIENCE_S)
        check_available(parse_url(f"udpin://127.0.0.1:{port}"))


async def test_an_autopilot_that_mavsdk_does_not_know_yet_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """At first it calls every one generic; the refusal names what they are."""
    describe = bridge._describe
    looks = 0  # since it has known the first one

    def slow(system: System) -> HeardSystem:
        nonlocal looks
        found = describe(system)
        looks += found == HeardSystem(3, "PX4")
        return HeardSystem(4, "GENERIC") if found.system_id == 4 and looks < 4 else found

    monkeypatch.setattr(bridge, "_describe", slow)
    port = free_udp_port()
    one, two = FakeVehicle(UdpWire(port), system_id=3), FakeVehicle(UdpWire(port), system_id=4)
    with one, two, pytest.raises(LinkError, match=r"heard 2: 3 \(PX4\), 4 \(PX4\)"):
        await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", listen_s=PATIENCE_S)


async def test_a_second_vehicle_that_is_heard_late_is_refused_too() -> None:
    """The link listens for as long as it was told to; nothing of it is left behind."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)), FakeVehicle(UdpWire(port), system_id=9) as late:
        late.silent = True
        url = f"udpin://127.0.0.1:{port}"
        connecting = asyncio.create_task(MavsdkLink.connect(url, listen_s=4.0))
        await asyncio.sleep(1.5)
        late.silent = False
        with pytest.raises(LinkError, match=r"1 \(PX4\), 9 \(PX4\)"):
            await connecting
        check_available(parse_url(url))


async def test_a_ground_station_beside_the_vehicle_is_no_second_vehicle() -> None:
    """Only autopilots count."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)), FakeVehicle(UdpWire(port), 255, INVALID_AUTOPILOT, GROUND_STATION, 0.0, 190):
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}", listen_s=2.0) as link:
            assert link.system_id == 1


def test_vehicles_are_told_apart_from_everything_else() -> None:
    """Nobody, one vehicle, or one with a ground station: nothing to choose; two: both are named."""
    url = parse_url("udpin://0.0.0.0:14540")
    one, two, station = HeardSystem(1, "PX4"), HeardSystem(2, "ARDUPILOT"), HeardSystem(255, None)
    for heard in ([], [one], [one, station]):
        refuse_several(url, heard)
    with pytest.raises(LinkError, match=r"heard 2: 1 \(PX4\), 2 \(ARDUPILOT\)"):
        refuse_several(url, [one, station, two])


async def test_udpout_and_tcpout_reach_a_vehicle_that_listens() -> None:
    """Both connect, stream and carry commands."""
    udp = UdpWire()
    with FakeVehicle(udp):
        async with await MavsdkLink.connect(f"udpout://localhost:{udp.port}") as link:
            assert await sees_odometry(link)
    tcp = TcpWire()
    with FakeVehicle(tcp) as vehicle:
        async with await MavsdkLink.connect(f"tcp://127.0.0.1:{tcp.port}") as link:
            assert await sees_odometry(link)
            link.request(Request(RequestKind.ARM))
            await arrived(lambda: bool(vehicle.commands(400)))


async def test_tcpin_waits_for_a_vehicle_that_connects() -> None:
    """The vehicle is the client here."""
    port = free_udp_port()
    with FakeVehicle(TcpClientWire(port)):
        async with await MavsdkLink.connect(f"tcpin://127.0.0.1:{port}") as link:
            assert await sees_odometry(link)


async def test_a_connect_that_is_given_up_leaves_nothing_behind() -> None:
    """Cancelled while it waits for a vehicle: the port is free again and no task is left."""
    url = f"udpin://127.0.0.1:{free_udp_port()}"
    connecting = asyncio.create_task(MavsdkLink.connect(url))
    await asyncio.sleep(0.3)
    connecting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await connecting
    check_available(parse_url(url))
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_a_serial_port_connects() -> None:
    """Over a pseudo terminal, as over a cable."""
    wire = SerialWire()
    with FakeVehicle(wire):
        async with await MavsdkLink.connect(f"serial://{wire.device}:57600") as link:
            assert await sees_odometry(link)


async def test_a_serial_port_that_comes_back_is_opened_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cable is pulled and put in again: silence is announced, then samples come through the new port."""
    monkeypatch.setattr(upkeep, "SILENCE_S", 0.5)
    monkeypatch.setattr(upkeep, "REOPEN_INTERVAL_S", 0.2)
    device = tmp_path / "ttyVehicle"
    first = SerialWire()
    device.symlink_to(first.device)
    with FakeVehicle(first):
        link = await MavsdkLink.connect(f"serial://{device}:57600")
    async with link:
        device.unlink()
        await until(link, lambda got: any("no heartbeat" in text for text in texts(got)))
        second = SerialWire()
        device.symlink_to(second.device)
        with FakeVehicle(second):
            await until(link, lambda got: any("is back" in text for text in texts(got)))
            assert await sees_odometry(link)


async def test_a_vehicle_without_timesync_is_announced() -> None:
    """Samples then carry arrival times, the offset stays unknown and a warning says so."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)) as vehicle:
        vehicle.answers_timesync = False
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}") as link:
            samples = await until(link, lambda got: any(isinstance(s, OdometrySample) for s in got))
            assert link.clock_offset is None
            assert any("TIMESYNC" in text for text in texts(samples))


async def test_silence_and_its_end_are_announced(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that falls silent is reported, and after its return the streams are asked for again."""
    monkeypatch.setattr(upkeep, "SILENCE_S", 0.5)
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)) as vehicle:
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}") as link:
            vehicle.silent = True
            await until(link, lambda got: any("no heartbeat" in text for text in texts(got)))
            vehicle.received.clear()
            vehicle.silent = False
            await until(link, lambda got: any("is back" in text for text in texts(got)))
            await arrived(lambda: 331.0 in [parameters[0] for parameters in vehicle.commands(511)])


_PROGRAM = """
import asyncio, sys
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import check_available
from uasfly.link.urls import parse_url
from uasfly.messages import Request, RequestKind

async def main():
    async with await MavsdkLink.connect(sys.argv[1]) as link:
        link.request(Request(RequestKind.ARM))
        print("up", flush=True)
        while True:
            await link.wait(1.0)
            link.poll()

try:
    asyncio.run(main())
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


async def test_ctrl_c_ends_a_program_cleanly_while_a_command_waits() -> None:
    """With an arm command unanswered, SIGINT ends the process by itself: exit code 0, nothing on stderr, no crash."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)) as vehicle:
        vehicle.answers[400] = None
        command = [sys.executable, "-c", _PROGRAM, f"udpin://127.0.0.1:{port}"]
        process = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            assert process.stdout is not None
            assert await asyncio.wait_for(process.stdout.readline(), 20.0) == b"up\n"
            await arrived(lambda: bool(vehicle.commands(400)))
            process.send_signal(signal.SIGINT)
            out, err = await asyncio.wait_for(process.communicate(), 10.0)
        finally:
            if process.returncode is None:
                process.kill()
        assert (process.returncode, out, err) == (0, b"interrupted\n", b"")
