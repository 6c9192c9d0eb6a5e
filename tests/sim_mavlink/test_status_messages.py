import math

import pytest

from tests.sim_mavlink.bench import UNIX_S, Bench, Message, only
from uasfly.messages import BatterySample, FlightMode, TextSample


@pytest.fixture
def bench() -> Bench:
    """An endpoint, 3 s after boot, when the vehicle can be armed."""
    bench = Bench()
    bench.run(3.0)
    return bench


def _last(bench: Bench, name: str, duration_s: float = 2.1) -> Message:
    return only(bench.run(duration_s), name)[-1]


def test_heartbeat_follows_arming_mode_and_failsafe(bench: Bench) -> None:
    """Standby, active, and critical when the vehicle flies another mode than it was asked to."""
    m = _last(bench, "HEARTBEAT")
    assert (m.type, m.autopilot, m.base_mode, m.custom_mode, m.system_status) == (2, 12, 29, 50593792, 3)
    bench.command(400, 1)
    m = _last(bench, "HEARTBEAT")
    assert (m.base_mode, m.system_status) == (157, 4)
    bench.vehicle.mode = FlightMode.DESCEND
    m = _last(bench, "HEARTBEAT")
    assert (m.custom_mode, m.system_status) == (335806464, 5)


def test_a_vehicle_that_cannot_be_armed_is_not_in_standby(bench: Bench) -> None:
    """Landing mode on the ground, offboard without setpoints, or no position: system_status 0, and no pre-arm check."""
    for mode in (FlightMode.LAND, FlightMode.OFFBOARD):
        bench.vehicle.mode = mode
        messages = bench.run(1.1)
        assert only(messages, "HEARTBEAT")[-1].system_status == 0
        assert not only(messages, "SYS_STATUS")[-1].onboard_control_sensors_health & 0x10000000
    bench.vehicle.mode, bench.vehicle.gnss_available = FlightMode.HOLD, False
    assert _last(bench, "HEARTBEAT").system_status == 0


def test_a_vehicle_that_has_just_booted_cannot_be_armed() -> None:
    """PX4 needs some seconds until it says that it is ready."""
    assert only(Bench().run(2.5), "HEARTBEAT")[-1].system_status == 0


def test_finished_takeoff_is_no_failsafe(bench: Bench) -> None:
    """Hold after take-off is what was wished for; hold after offboard is not."""
    bench.command(400, 1)
    bench.command(176, 1, 4, 2)
    bench.vehicle.mode = FlightMode.HOLD
    assert _last(bench, "HEARTBEAT").system_status == 4
    bench.command(176, 1, 6)
    bench.vehicle.mode = FlightMode.HOLD
    messages = bench.run(2.1)
    assert only(messages, "HEARTBEAT")[-1].system_status == 5
    mode = only(messages, "CURRENT_MODE")[-1]
    assert (mode.custom_mode, mode.intended_custom_mode) == (50593792, 393216)


def test_a_change_of_mode_is_told_at_once_to_who_asks_for_it(bench: Bench) -> None:
    """CURRENT_MODE at a high rate comes twice a second, and within a few steps of a change."""
    assert bench.result(511, 436, 20000.0) == 0
    assert len(only(bench.run(2.0), "CURRENT_MODE")) == pytest.approx(4, abs=1)
    bench.command(176, 1, 4, 6)
    (m,) = only(bench.run(0.04), "CURRENT_MODE")
    assert (m.custom_mode, m.standard_mode) == (100925440, 7)


def test_landed_state_distinguishes_take_off_flight_and_landing(bench: Bench) -> None:
    """On the ground 1 in any mode; in the air 3, 2 and 4."""
    assert _last(bench, "EXTENDED_SYS_STATE").landed_state == 1
    bench.vehicle.in_air = True
    for mode, landed in ((FlightMode.TAKEOFF, 3), (FlightMode.HOLD, 2), (FlightMode.LAND, 4), (FlightMode.OFFBOARD, 2)):
        bench.vehicle.mode = mode
        assert _last(bench, "EXTENDED_SYS_STATE").landed_state == landed


def test_lost_gnss_shows_as_px4_shows_it(bench: Bench) -> None:
    """The position falls at once, what counts on GNSS after 7 s; the commander trusts a position for a second old."""
    messages = bench.run(1.1)
    status, estimator = only(messages, "SYS_STATUS")[-1], only(messages, "ESTIMATOR_STATUS")[-1]
    assert status.onboard_control_sensors_present == 50380847
    assert status.onboard_control_sensors_enabled == 50446383
    assert status.onboard_control_sensors_health == 320915519
    assert estimator.flags == 1023
    assert estimator.pos_horiz_accuracy == pytest.approx(0.3)
    bench.vehicle.in_air, bench.vehicle.armed, bench.vehicle.gnss_available = True, True, False
    messages = bench.run(1.1)
    status, estimator = only(messages, "SYS_STATUS")[-1], only(messages, "ESTIMATOR_STATUS")[-1]
    assert status.onboard_control_sensors_present == 50380847
    assert status.onboard_control_sensors_health == 320899135
    assert estimator.flags == 869
    assert math.isnan(estimator.pos_horiz_ratio)
    messages = bench.run(7.0)
    status, estimator = only(messages, "SYS_STATUS")[-1], only(messages, "ESTIMATOR_STATUS")[-1]
    assert status.onboard_control_sensors_present == 50380815
    assert estimator.flags == 101
    bench.vehicle.gnss_available = True
    messages = bench.run(0.9)
    assert _last(bench, "ESTIMATOR_STATUS").flags == 895
    assert only(messages, "SYS_STATUS")[-1].onboard_control_sensors_health == 320899135
    status = only(bench.run(0.5), "SYS_STATUS")[-1]
    assert (status.onboard_control_sensors_present, status.onboard_control_sensors_health) == (50380847, 320915519)


def test_battery_is_told_as_one_cell(bench: Bench) -> None:
    """Whole voltage in the first cell, no current; remaining is rounded here and rounded up in SYS_STATUS."""
    messages = bench.run(2.1)
    battery, status = only(messages, "BATTERY_STATUS")[-1], only(messages, "SYS_STATUS")[-1]
    assert battery.voltages == [15800, *[65535] * 9]
    assert (battery.battery_remaining, battery.current_battery, battery.charge_state) == (78, -1, 1)
    assert (status.voltage_battery, status.battery_remaining) == (15800, 79)


@pytest.mark.parametrize(("remaining", "state"), [(0.151, 1), (0.149, 2), (0.069, 3), (0.049, 4)])
def test_a_low_battery_has_its_charge_state(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, remaining: float, state: int
) -> None:
    """The thresholds are PX4's BAT_LOW_THR, BAT_CRIT_THR and BAT_EMERGEN_THR."""
    monkeypatch.setattr(bench.vehicle, "battery", lambda: BatterySample(0.0, 14.0, remaining))
    assert _last(bench, "BATTERY_STATUS").charge_state == state


def test_an_unknown_battery_is_told_as_unknown(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """NaN becomes MAVLink's "unknown" instead of an error."""
    monkeypatch.setattr(bench.vehicle, "battery", lambda: BatterySample(0.0, math.nan, math.nan))
    messages = bench.run(2.1)
    assert only(messages, "BATTERY_STATUS")[-1].battery_remaining == -1
    status = only(messages, "SYS_STATUS")[-1]
    assert (status.voltage_battery, status.battery_remaining) == (65535, -1)


def test_system_time_carries_both_clocks(bench: Bench) -> None:
    """Time of day, and time since boot."""
    m = _last(bench, "SYSTEM_TIME", 1.0)
    assert m.time_unix_usec == int(UNIX_S * 1e6)
    assert 3000 <= m.time_boot_ms <= 4000


@pytest.mark.parametrize("length", [1, 49, 50, 51, 99, 100, 120])
def test_texts_of_any_length_arrive_whole(bench: Bench, length: int) -> None:
    """Long texts come in pieces of 50 with one id, the last of which is not full; short ones in one."""
    text = "".join(chr(ord("a") + i % 26) for i in range(length))
    bench.vehicle.texts.append(TextSample(1.0, 4, text))
    pieces = only(bench.run(0.02), "STATUSTEXT")
    assert "".join(piece.text for piece in pieces) == text
    assert {piece.severity for piece in pieces} == {4}
    assert [piece.chunk_seq for piece in pieces] == list(range(len(pieces)))
    if length <= 50:
        assert [piece.id for piece in pieces] == [0]
    else:
        assert len({piece.id for piece in pieces}) == 1
        assert pieces[0].id > 0
        assert len(pieces[-1].text) < 50


def test_a_hexacopter_says_so(bench: Bench) -> None:
    """HEARTBEAT's type is the parameter MAV_TYPE."""
    bench.vehicle.parameters["MAV_TYPE"] = (int, 13)
    assert _last(bench, "HEARTBEAT").type == 13


@pytest.mark.parametrize(("value", "told"), [(300, 255), (-1, 0), (2**31 - 1, 255)])
def test_a_type_that_no_heartbeat_can_carry_is_cut(bench: Bench, value: int, told: int) -> None:
    """PARAM_SET may set MAV_TYPE to anything."""
    bench.vehicle.parameters["MAV_TYPE"] = (int, value)
    assert _last(bench, "HEARTBEAT").type == told
