import math

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, only
from uasfly.messages import FlightMode

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
LAND, RETURN, TAKEOFF, SET_MODE, REPOSITION, ARM, FAILURE = 21, 20, 22, 176, 192, 400, 420
GET_INTERVAL, SET_INTERVAL, REQUEST = 510, 511, 512


@pytest.fixture
def bench() -> Bench:
    """An endpoint, 1 s after boot."""
    bench = Bench()
    bench.run(1.0)
    return bench


def test_an_acknowledgement_names_the_command_and_its_sender() -> None:
    """Target system and component are the sender's; the other fields are zero, as recorded."""
    bench = Bench(client=(245, 190))
    (ack,) = bench.command(ARM, 1)
    assert (ack.get_srcSystem(), ack.get_srcComponent()) == (1, 1)
    assert (ack.command, ack.result, ack.progress, ack.result_param2) == (ARM, ACCEPTED, 0, 0)
    assert (ack.target_system, ack.target_component) == (245, 190)


def test_arming_and_disarming_reach_the_vehicle(bench: Bench) -> None:
    """Parameter 1 is 1 or 0; anything else is unsupported, as in PX4's commander."""
    assert bench.result(ARM, 1) == ACCEPTED
    assert bench.vehicle.armed
    assert bench.result(ARM, 0) == ACCEPTED
    assert not bench.vehicle.armed
    assert bench.result(ARM, 2) == UNSUPPORTED
    assert bench.result(ARM, math.nan) == UNSUPPORTED


def test_disarming_in_the_air_takes_force(bench: Bench) -> None:
    """Parameter 2 = 21196 forces it, as MAVLink has it."""
    bench.result(ARM, 1)
    bench.vehicle.in_air = True
    assert bench.result(ARM, 0) == REJECTED
    assert bench.vehicle.armed
    assert bench.result(ARM, 0, 21196) == ACCEPTED
    assert not bench.vehicle.armed


@pytest.mark.parametrize(
    ("command", "mode"),
    [
        ((SET_MODE, 1, 6), FlightMode.OFFBOARD),
        ((SET_MODE, 1, 4, 3), FlightMode.HOLD),
        ((SET_MODE, 209, 4, 6), FlightMode.LAND),
        ((SET_MODE, 1, 3), FlightMode.POSITION),
        ((TAKEOFF,), FlightMode.TAKEOFF),
        ((LAND,), FlightMode.LAND),
        ((RETURN,), FlightMode.RETURN),
        ((REPOSITION, -1, 1, 0, math.nan, math.nan, math.nan, math.nan), FlightMode.HOLD),
    ],
)
def test_commands_change_the_mode(bench: Bench, command: tuple[float, ...], mode: FlightMode) -> None:
    """Every way that PX4 offers to each mode."""
    bench.vehicle.mode = FlightMode.OTHER
    assert bench.result(int(command[0]), *command[1:]) == ACCEPTED
    assert bench.vehicle.mode is mode


@pytest.mark.parametrize("command", [(SET_MODE, 1, 6), (ARM, 1), (TAKEOFF,)])
def test_a_refusal_is_temporary(bench: Bench, command: tuple[float, ...]) -> None:
    """Result 1, as recorded for offboard without setpoints in flight; the vehicle's own words follow, once."""
    bench.vehicle.refusal = "no setpoints"
    assert bench.result(int(command[0]), *command[1:]) == REJECTED
    (text,) = only(bench.run(0.05), "STATUSTEXT")
    assert text.text == "no setpoints"
    assert bench.vehicle.mode is FlightMode.HOLD


@pytest.mark.parametrize("parameters", [(1, 4, 4), (1, 4, 20), (1, 1), (1, 9), (0, 4, 3), (math.nan, 4, 3)])
def test_modes_that_do_not_exist_are_rejected(bench: Bench, parameters: tuple[float, ...]) -> None:
    """Missions, Descend, manual and unknown modes, and a base mode without the custom flag."""
    assert bench.result(SET_MODE, *parameters) == REJECTED
    assert bench.vehicle.mode is FlightMode.HOLD
    (text,) = only(bench.run(0.05), "STATUSTEXT")
    assert "Unsupported mode" in text.text


def test_takeoff_height_is_above_home(bench: Bench) -> None:
    """Parameter 7 is above the sea; without it the vehicle's own height counts."""
    bench.result(TAKEOFF, *(math.nan,) * 7)
    assert math.isnan(bench.vehicle.takeoff_height_m)
    home = bench.endpoint.view.home.position_m[2]
    bench.result(TAKEOFF, 0, 0, 0, 0, 0, 0, 489.4 - home + 4.0)
    assert bench.vehicle.takeoff_height_m == pytest.approx(4.0, abs=1e-4)


def test_command_int_is_answered_alike(bench: Bench) -> None:
    """COMMAND_INT carries the same parameters 1 to 4 and 7."""
    message = dialect.MAVLink_command_int_message(1, 1, 0, SET_MODE, 0, 0, 1, 4, 6, 0, 0, 0, 0)
    (ack,) = bench.ask(message)
    assert (ack.command, ack.result) == (SET_MODE, ACCEPTED)
    assert bench.vehicle.mode is FlightMode.LAND


def test_old_set_mode_is_not_acknowledged(bench: Bench) -> None:
    """The message SET_MODE changes the mode in silence."""
    assert bench.ask(dialect.MAVLink_set_mode_message(1, 1, 6 << 16)) == []
    assert bench.vehicle.mode is FlightMode.OFFBOARD


def test_unknown_commands_are_unsupported(bench: Bench) -> None:
    """Result 3 for what the vehicle does not know, and for going to a place."""
    assert bench.result(31010) == UNSUPPORTED
    assert bench.result(REPOSITION, -1, 1, 0, 0, 47.0, 8.0, 500.0) == UNSUPPORTED


@pytest.mark.parametrize("target", [(2, 1), (1, 100), (2, 0)])
def test_commands_for_others_are_not_answered(bench: Bench, target: tuple[int, int]) -> None:
    """Another system or another component of this one."""
    assert bench.command(ARM, 1, target=target) == []
    assert not bench.vehicle.armed


@pytest.mark.parametrize("target", [(0, 0), (0, 1), (1, 0)])
def test_commands_for_everybody_are_answered(bench: Bench, target: tuple[int, int]) -> None:
    """Target 0 is everybody."""
    (ack,) = bench.command(ARM, 1, target=target)
    assert ack.result == ACCEPTED


def test_gnss_failure_can_be_injected(bench: Bench) -> None:
    """Unit 4 off and on again; PX4 acknowledges it to everybody; other units and kinds are unsupported."""
    (ack,) = bench.command(FAILURE, 4, 1)
    assert (ack.result, ack.target_system, ack.target_component) == (ACCEPTED, 0, 0)
    assert not bench.vehicle.gnss_available
    assert bench.result(FAILURE, 4, 0) == ACCEPTED
    assert bench.vehicle.gnss_available
    assert bench.result(FAILURE, 3, 1) == UNSUPPORTED
    assert bench.result(FAILURE, 4, 7) == UNSUPPORTED


@pytest.mark.parametrize(
    ("parameters", "result"),
    [
        ((331, 10000.0), ACCEPTED),
        ((32, 10000.0), ACCEPTED),
        ((31, 10000.0), ACCEPTED),
        ((83, 20000.0), ACCEPTED),
        ((147, 500000.0), ACCEPTED),
        ((132, 100000.0), ACCEPTED),  # known to PX4, but without data
        ((0, 100000.0), FAILED),
        ((999, 100000.0), FAILED),
        ((331, 10000.0, 1.0), FAILED),
        ((331, 10000.0, 0.0, 0.0, 0.0, 0.0, 2.0), FAILED),
        ((331, 10000.0, math.nan, math.nan, 0.0, 0.0, math.nan), ACCEPTED),
    ],
)
def test_intervals_have_the_recorded_results(bench: Bench, parameters: tuple[float, ...], result: int) -> None:
    """HEARTBEAT and unknown messages fail with 4, as in the recording; so do parameters that PX4 does not take."""
    assert bench.result(SET_INTERVAL, *parameters) == result


def test_an_interval_changes_the_rate(bench: Bench) -> None:
    """ODOMETRY at 100 Hz, then its default again, then none."""
    for interval_us, rate in ((10000.0, 100), (0.0, 30), (-1.0, 0)):
        assert bench.result(SET_INTERVAL, 331, interval_us) == ACCEPTED
        assert len(only(bench.run(1.0), "ODOMETRY")) == pytest.approx(rate, abs=1)


def test_intervals_can_be_asked_for(bench: Bench) -> None:
    """By its own command or by requesting MESSAGE_INTERVAL; the answer precedes the acknowledgement."""
    for number, parameters in ((GET_INTERVAL, (30,)), (REQUEST, (244, 30))):
        interval, ack = bench.command(number, *parameters)
        assert (interval.message_id, interval.interval_us) == (30, 10000)
        assert (ack.command, ack.result) == (number, ACCEPTED)
    assert bench.command(GET_INTERVAL, 999)[0].interval_us == -1


@pytest.mark.parametrize("message_id", [148, 242, 0, 331, 49])
def test_a_requested_message_precedes_its_acknowledgement(bench: Bench, message_id: int) -> None:
    """AUTOPILOT_VERSION, HOME_POSITION and any stream."""
    message, ack = bench.command(REQUEST, message_id)
    assert message.get_msgId() == message_id
    assert (ack.command, ack.result) == (REQUEST, ACCEPTED)


def test_a_message_that_cannot_be_sent_is_denied(bench: Bench) -> None:
    """PX4 answers 2 for unknown messages and for those without data."""
    assert bench.result(REQUEST, 999) == DENIED
    assert bench.result(REQUEST, 132) == DENIED


def test_autopilot_version_is_px4s(bench: Bench) -> None:
    """Capabilities and version are those of the recording; the identity is the system's own."""
    version = bench.command(REQUEST, 148)[0]
    assert version.capabilities == 59647
    assert version.flight_sw_version == 17956928
    other = Bench(system_id=2).command(REQUEST, 148, target=(2, 1))[0]
    assert version.uid != other.uid


def test_protocol_version_is_framed_as_px4_frames_it(bench: Bench) -> None:
    """PROTOCOL_VERSION is not in pymavlink's dialects; its frame has PX4's number, versions and kind of checksum."""
    frame, _ack = bench.frames(dialect.MAVLink_command_long_message(1, 1, REQUEST, 0, 300, *(0,) * 6))
    # as recorded, but for sequence and system, and for the hashes of PX4's build: zeros at the end are not sent
    assert frame[:4] == bytes.fromhex("fd050000")
    assert frame[6:15] == bytes.fromhex("012c0100 c8006400cb")
    assert frame[15:] == dialect.x25crc(frame[1:15] + bytes((217,))).crc.to_bytes(2, "little")


def test_protocol_versions_checksum_is_that_of_the_recording() -> None:
    """The recorded frame has the checksum that the number 217 gives."""
    recorded = bytes.fromhex("fd1600004906012c0100c8006400cb0000000000000000000c8bcb4ee17cfabaf3d2")
    assert recorded[-2:] == dialect.x25crc(recorded[1:-2] + bytes((217,))).crc.to_bytes(2, "little")
