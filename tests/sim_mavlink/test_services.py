import struct

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, only

HEADER = struct.Struct("<HBBBBBBI")


@pytest.fixture
def bench() -> Bench:
    """An endpoint, 2 s after boot."""
    bench = Bench()
    bench.run(2.0)
    return bench


def test_timesync_returns_the_vehicles_clock(bench: Bench) -> None:
    """The clock runs on between the steps of the simulation: the answer is as fine as the clock."""
    bench.clock_ahead_s = 0.0012345
    (m,) = bench.ask(dialect.MAVLink_timesync_message(0, 777))
    assert m.ts1 == 777
    assert m.tc1 == pytest.approx(2.0012345e9, abs=100)


def test_answers_to_the_vehicles_own_requests_need_nothing(bench: Bench) -> None:
    """A TIMESYNC with both times is such an answer."""
    assert bench.ask(dialect.MAVLink_timesync_message(555, 777)) == []


def test_the_vehicle_asks_for_the_time_itself(bench: Bench) -> None:
    """TIMESYNC at 10 Hz with tc1 = 0 and the vehicle's own clock."""
    received = only(bench.run(1.0), "TIMESYNC")
    assert len(received) == pytest.approx(10, abs=1)
    assert {m.tc1 for m in received} == {0}
    assert 2e9 < received[0].ts1 < received[-1].ts1 <= 3e9


def test_ping_is_returned_to_its_sender(bench: Bench) -> None:
    """A request has no target; an answer to the vehicle's own ping needs nothing."""
    (m,) = bench.ask(dialect.MAVLink_ping_message(123, 4, 0, 0))
    assert (m.time_usec, m.seq, m.target_system, m.target_component) == (123, 4, 1, 191)
    assert bench.ask(dialect.MAVLink_ping_message(123, 4, 1, 1)) == []


def test_the_vehicle_pings_with_growing_numbers(bench: Bench) -> None:
    """One a second."""
    numbers = [m.seq for m in only(bench.run(4.0), "PING")]
    assert len(numbers) == pytest.approx(4, abs=1)
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


@pytest.mark.parametrize("mission_type", [0, 1, 2])
def test_there_are_no_missions(bench: Bench, mission_type: int) -> None:
    """A list is empty, clearing succeeds, an upload is unsupported, each for missions, fences and rally points."""
    (count,) = bench.ask(dialect.MAVLink_mission_request_list_message(1, 1, mission_type))
    assert (count.get_type(), count.count, count.mission_type) == ("MISSION_COUNT", 0, mission_type)
    (cleared,) = bench.ask(dialect.MAVLink_mission_clear_all_message(1, 1, mission_type))
    assert (cleared.get_type(), cleared.type, cleared.mission_type) == ("MISSION_ACK", 0, mission_type)
    (refused,) = bench.ask(dialect.MAVLink_mission_count_message(1, 1, 3, mission_type))
    assert (refused.get_type(), refused.type) == ("MISSION_ACK", 3)


@pytest.mark.parametrize(
    ("opcode", "answer", "error"),
    [(1, 128, None), (2, 128, None), (3, 129, 6), (4, 129, 10), (15, 129, 10), (9, 129, 7)],
)
def test_there_are_no_files(bench: Bench, opcode: int, answer: int, error: int | None) -> None:
    """Sessions can be ended, folders are empty, files are not found, everything else is an unknown command."""
    payload = list(HEADER.pack(41, 0, opcode, 0, 0, 0, 0, 0).ljust(251, b"\0"))
    (m,) = bench.ask(dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    sequence, _, code, size, asked, *_ = HEADER.unpack(bytes(m.payload[: HEADER.size]))
    assert (sequence, code, asked) == (42, answer, opcode)
    assert list(m.payload[HEADER.size : HEADER.size + size]) == ([] if error is None else [error])
    assert (m.target_system, m.target_component) == (1, 191)


def test_there_are_no_logs(bench: Bench) -> None:
    """One entry that says so."""
    (m,) = bench.ask(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert (m.get_type(), m.num_logs, m.size) == ("LOG_ENTRY", 0, 0)
