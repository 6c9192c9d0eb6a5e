"""What the relay and the cycle's watcher count."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.control.vehicle import f550
from uasfly.airframe import Airframe
from uasfly.bench.cycle import Watcher
from uasfly.bench.link_relay import RoundTrips, message_ids
from uasfly.bench.observer import measure_observer
from uasfly.drivers.watching import Cycle
from uasfly.messages import Phase
from uasfly.observer import Observer


def _packed(message: dialect.MAVLink_message) -> bytes:
    return bytes(message.pack(dialect.MAVLink(None, 1, 1)))


HEARTBEAT = _packed(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 0, 3))
ODOMETRY = _packed(
    dialect.MAVLink_odometry_message(0, 1, 1, *(0.0,) * 3, (1.0, 0.0, 0.0, 0.0), *(0.0,) * 6, (0.0,) * 21, (0.0,) * 21)
)
SETPOINT = _packed(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 3, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.5))


def test_messages_of_a_datagram_are_told_apart() -> None:
    """Several in one datagram, and nothing where there is no message."""
    assert list(message_ids(HEARTBEAT + ODOMETRY + SETPOINT)) == [0, 331, 82]
    assert list(message_ids(b"")) == []
    assert list(message_ids(b"\x00" * 40)) == []


def test_a_round_trip_runs_from_the_newest_motion_to_the_first_setpoint() -> None:
    """A second setpoint answers nothing, other messages begin and end nothing."""
    trips = RoundTrips()
    trips.to_vehicle(SETPOINT, 0.5)
    trips.to_program(ODOMETRY, 1.0)
    trips.to_program(ODOMETRY, 1.01)
    trips.to_program(HEARTBEAT, 1.0105)
    trips.to_vehicle(HEARTBEAT, 1.0107)
    trips.to_vehicle(SETPOINT, 1.011)
    trips.to_vehicle(SETPOINT, 1.012)
    assert trips.times_ms == [pytest.approx(1.0)]


def test_only_cycles_on_the_way_count_and_enough_of_them_end_the_flight() -> None:
    """Before the legs nothing is counted."""
    ended: list[int] = []
    watcher = Watcher(2, lambda done: None, lambda: ended.append(1))
    for phase in (Phase.TAKEOFF, Phase.LEGS, Phase.LEGS):
        watcher.watch(SimpleNamespace(phase=phase), Cycle(sent=True, cycle_ms=1.0, solve_ms=0.1))  # type: ignore[arg-type]
        watcher.measured(1.5)
    assert watcher.cycles_ms == [1.5, 1.5]
    assert watcher.solves_ms == [0.1, 0.1]
    assert watcher.to_setpoints_ms == [1.0, 1.0]
    assert ended == [1]


def test_the_observer_takes_all_that_it_is_measured_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the made-up flight no more is refused than a gate refuses by chance: what is timed is the whole work."""
    from uasfly.bench import observer as bench

    made = []

    class Kept(Observer):
        """Remembers who was made."""

        def __init__(self, airframe: Airframe, prepared_markers: int = 0) -> None:
            super().__init__(airframe, prepared_markers)
            made.append(self)

    monkeypatch.setattr(bench, "Observer", Kept)
    figures = measure_observer(f550(), 100)
    assert figures.odometry.median > 0.0
    assert figures.with_marker.median > 0.0
    for observer in made:
        counters = observer.counters
        assert sum(counters.rejected.values()) < 0.01 * 3 * 300
        assert (counters.non_finite, counters.dropped, counters.duplicates, counters.late) == (0, 0, 0, 0)
    assert len(made[1].covariance) == len(made[0].covariance) + 6
