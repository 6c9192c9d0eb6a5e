"""The MAVSDK link against a vehicle on the loopback: samples, setpoints, texts, time."""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import replace

import numpy as np
import pytest

from tests.link.fake_vehicle import FakeVehicle, mavlink
from tests.link.waiting import Pair, arrived, texts, until
from tests.link.wires import UdpWire
from tests.winds import wind_estimate
from uasfly.errors import LinkError
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.link.ports import free_udp_port
from uasfly.link.protocol import VehicleLink
from uasfly.messages import (
    FlightMode,
    LinkEvent,
    LinkSample,
    OdometrySample,
    Setpoint,
    TextSample,
    TruthSample,
    VehicleSample,
)

LEVEL = Setpoint(0.0, 0.0, 0.0, 0.5 * math.pi, 0.0, 0.5)


async def test_the_link_joins_the_vehicles_system_and_asks_for_its_streams(
    pair: Pair,
) -> None:
    """The companion's heartbeat carries the vehicle's system id, and the intervals are those the flight needs."""
    link, vehicle = pair
    end: VehicleLink = link
    assert end is link
    assert link.system_id == 7
    intervals = {int(p[0]): p[1] for p in vehicle.commands(511)}
    assert intervals[331] == 10_000.0
    assert intervals[83] == 20_000.0
    assert intervals[350] == 20_000.0
    await arrived(lambda: any(m.get_srcSystem() == 7 for m in vehicle.of_type("HEARTBEAT")))
    heartbeat = vehicle.of_type("HEARTBEAT")[-1]
    assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent(), heartbeat.type) == (7, 195, 18)


async def test_samples_carry_the_hosts_time_of_when_they_were_true(pair: Pair) -> None:
    """Position and velocity come in ENU with host times, although the vehicle's clock is 500 s ahead."""
    link, _ = pair
    assert link.clock_offset == pytest.approx(-500.0, abs=0.05)
    assert 0.0 < link.round_trip_s < 1.0
    link.poll()
    before_s = time.monotonic()
    samples = await until(link, lambda got: sum(isinstance(sample, OdometrySample) for sample in got) >= 10)
    odometry = [sample for sample in samples if isinstance(sample, OdometrySample)]
    assert [sample.time_s for sample in odometry] == sorted(sample.time_s for sample in odometry)
    assert before_s - 0.2 < odometry[-1].time_s <= time.monotonic()
    np.testing.assert_allclose(odometry[-1].position_in_world, (2.0, 1.0, 3.0), atol=1e-6)
    np.testing.assert_allclose(odometry[-1].velocity_in_world, (0.2, 0.1, 0.3), atol=1e-6)
    np.testing.assert_allclose(odometry[-1].angular_rate_in_body, (0.01, -0.02, -0.03), atol=1e-6)
    assert odometry[-1].reset_counter == 5
    assert link.message_rates()["ODOMETRY"] > 5.0
    assert "ODOMETRY unusable" not in link.losses()


async def test_a_cycle_can_wait_for_motion(pair: Pair) -> None:
    """It is told of the next ODOMETRY, not of one that waits already, and of silence after the time-out."""
    link, vehicle = pair
    await until(link, lambda got: any(isinstance(sample, OdometrySample) for sample in got))
    assert await link.wait_for_motion(10.0)
    assert any(isinstance(sample, OdometrySample) for sample in link.poll())
    vehicle.silent = True
    await asyncio.sleep(0.3)  # what is on its way arrives, and waits
    assert not await link.wait_for_motion(0.1)


async def test_mode_and_truth_come_through(pair: Pair) -> None:
    """HEARTBEAT makes a VehicleSample, the truth array a TruthSample in its own frames."""
    link, vehicle = pair
    vehicle.armed = True
    samples = await until(
        link,
        lambda got: (
            any(isinstance(s, VehicleSample) and s.armed for s in got) and any(isinstance(s, TruthSample) for s in got)
        ),
    )
    state = next(sample for sample in samples if isinstance(sample, VehicleSample) and sample.armed)
    truth = next(sample for sample in samples if isinstance(sample, TruthSample))
    assert state.mode is FlightMode.HOLD
    np.testing.assert_allclose(truth.position_in_world, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(truth.force_in_world, (-1.5, 0.5, 0.0))
    np.testing.assert_allclose(truth.wind_in_world, (8.0, 0.0, 0.0))


async def test_a_setpoint_arrives_once_and_complete(pair: Pair) -> None:
    """Type mask 3, every field, no repeats; wrong ones are refused and never leave."""
    link, vehicle = pair
    for wrong in (math.nan, math.inf, -0.01, 1.01):
        with pytest.raises(ValueError, match=r"finite|thrust"):
            link.send(Setpoint(0.0, 0.0, 0.0, 0.0, 0.0, wrong))
    with pytest.raises(ValueError, match="finite"):
        link.send(Setpoint(0.0, math.nan, 0.0, 0.0, 0.0, 0.5))
    link.send(Setpoint(time.monotonic(), 0.1, -0.2, 1.0, 0.3, 0.625))
    await arrived(lambda: bool(vehicle.of_type("SET_ATTITUDE_TARGET")))
    await asyncio.sleep(0.3)
    (target,) = vehicle.of_type("SET_ATTITUDE_TARGET")
    assert (target.target_system, target.target_component, target.type_mask) == (7, 1, 3)
    assert (target.thrust, target.body_roll_rate, target.body_pitch_rate) == (0.625, 0.0, 0.0)
    assert target.body_yaw_rate == pytest.approx(-0.3)
    assert target.time_boot_ms == pytest.approx(vehicle.time_s * 1e3, abs=2000.0)
    assert sum(value * value for value in target.q) == pytest.approx(1.0, abs=1e-5)
    assert target.q[0] != 1.0


async def test_an_old_setpoint_stays_here(pair: Pair) -> None:
    """Made 0.16 s ago it is not sent, but counted; one that was made now is."""
    link, vehicle = pair
    assert not link.send(replace(LEVEL, time_s=time.monotonic() - 0.16))
    assert link.losses()["stale setpoints"] == 1
    assert link.send(replace(LEVEL, time_s=time.monotonic()))
    await arrived(lambda: bool(vehicle.of_type("SET_ATTITUDE_TARGET")))
    await asyncio.sleep(0.3)
    assert len(vehicle.of_type("SET_ATTITUDE_TARGET")) == 1


async def test_a_reader_that_comes_late_gets_the_newest_samples(pair: Pair) -> None:
    """At most 16 odometry samples wait; the newest win and the rest is counted."""
    link, vehicle = pair
    await arrived(lambda: vehicle.rates_hz["ODOMETRY"] == 100.0)
    link.poll()
    vehicle.position_ned = (7.0, 0.0, 0.0)
    await asyncio.sleep(1.0)
    odometry = [sample for sample in link.poll() if isinstance(sample, OdometrySample)]
    assert 5 < len(odometry) <= 16
    assert odometry[-1].position_in_world[1] == pytest.approx(7.0)
    assert time.monotonic() - odometry[-1].time_s < 0.5
    assert link.losses()["ODOMETRY overrun"] > 0
    assert not any(isinstance(sample, OdometrySample) and sample.time_s < odometry[-1].time_s for sample in link.poll())


async def test_texts_go_both_ways(pair: Pair) -> None:
    """Quotes and chunks survive; texts beyond 50 characters go out in chunks with one id."""
    link, vehicle = pair
    long = 'a "quoted" text \\ that is longer than the fifty characters of one message, in two'
    vehicle.send(mavlink.MAVLink_statustext_message(3, b'say "hi"\t'))
    for index in range(2):
        chunk = long.encode()[50 * index : 50 * (index + 1)]
        vehicle.send(mavlink.MAVLink_statustext_message(4, chunk, 9, index))
    samples = await until(link, lambda got: long in texts(got))
    assert 'say "hi"' in texts(samples)
    link.send_text(6, "x" * 70)
    link.send_text(2, "short")
    await arrived(lambda: len(vehicle.of_type("STATUSTEXT")) >= 3)
    first, second, third = vehicle.of_type("STATUSTEXT")
    assert first.text + second.text == "x" * 70
    assert first.id == second.id != 0
    assert (third.severity, third.text) == (2, "short")


async def test_the_wind_goes_to_the_ground_station(pair: Pair) -> None:
    """As WIND_COV of the companion computer: towards north and east, what is not known as NaN."""
    link, vehicle = pair
    link.send_wind(wind_estimate())
    await arrived(lambda: bool(vehicle.of_type("WIND_COV")))
    (told,) = vehicle.of_type("WIND_COV")
    assert (told.wind_x, told.wind_y, told.horiz_accuracy, told.var_horiz) == pytest.approx((-3.0, -5.0, 0.2, 1.1))
    assert all(map(math.isnan, (told.wind_z, told.var_vert, told.wind_alt)))
    assert told.vert_accuracy == 0.0
    assert (told.get_srcSystem(), told.get_srcComponent()) == (7, 195)


async def test_a_restart_of_the_vehicle_is_announced_and_set_up_again(pair: Pair) -> None:
    """Its clock goes back: a warning comes, streams are asked for again and times are right again."""
    link, vehicle = pair
    vehicle.received.clear()
    vehicle.clock_ahead_s = -time.monotonic() + 3.0  # booted 3 s ago
    vehicle.rates_hz["ODOMETRY"] = 30.0
    samples = await until(link, lambda got: any("restarted" in text for text in texts(got)))
    warning = next(s for s in samples if isinstance(s, TextSample) and "restarted" in s.text)
    assert warning.severity == 4
    assert LinkEvent.REBOOTED in [sample.event for sample in samples if isinstance(sample, LinkSample)]
    await arrived(lambda: 331.0 in [parameters[0] for parameters in vehicle.commands(511)])
    await arrived(lambda: link.clock_offset is not None)
    assert link.clock_offset == pytest.approx(-vehicle.clock_ahead_s, abs=0.05)


async def test_a_closed_link_is_quiet_and_gives_its_port_back() -> None:
    """Closing twice is fine, polls are empty, setpoints and requests are refused with a clear error."""
    port = free_udp_port()
    with FakeVehicle(UdpWire(port)):
        link = await MavsdkLink.connect(f"udpin://127.0.0.1:{port}")
        tasks = asyncio.all_tasks()
        began_s = time.monotonic()
        await link.close()
        await link.close()
        assert time.monotonic() - began_s < 1.0
        assert asyncio.all_tasks() <= tasks
        assert {task.get_name() for task in asyncio.all_tasks()} == {asyncio.current_task().get_name()}  # type: ignore[union-attr]
        assert link.poll() == ()
        await link.wait(10.0)
        with pytest.raises(LinkError, match="closed"):
            link.send(LEVEL)
        with pytest.raises(LinkError, match="closed"):
            link.send_text(6, "late")
        async with await MavsdkLink.connect(f"udpin://127.0.0.1:{port}") as again:
            assert again.system_id == 1


async def test_a_text_that_is_no_utf_8_stays_out_of_the_terminal(pair: Pair, capfd: pytest.CaptureFixture[str]) -> None:
    """MAVSDK logs every status text; its Python wrapper fails at other bytes and lets them through to the terminal."""
    link, vehicle = pair
    vehicle.send(mavlink.MAVLink_statustext_message(4, b"caf\xe9 \xff\x1b[31m"))
    await until(link, lambda got: any(text.startswith("caf") for text in texts(got)))
    assert capfd.readouterr() == ("", "")
