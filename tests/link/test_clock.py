"""Vehicle time to host time: seeded Monte Carlo of links and clocks, restarts, fall-backs."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from uasfly.link.clock import ClockMap
from uasfly.link.timesync import TimeSync


@dataclass
class Wire:
    """A link and a vehicle clock: each leg takes half of `fixed_s` plus an exponential delay of mean `jitter_s`."""

    fixed_s: float
    jitter_s: float
    drift: float = 4e-5
    start_s: float = 1000.0
    tick_s: float = 0.0

    def vehicle(self, host_s: float) -> float:
        """The vehicle's clock: it was 5 s at the start."""
        time_s = 5.0 + (host_s - self.start_s) * (1.0 + self.drift)
        return math.floor(time_s / self.tick_s) * self.tick_s if self.tick_s else time_s


def run(wire: Wire, seed: int, duration_s: float, clock: ClockMap) -> tuple[list[float], int]:
    """Exchanges at the pace that TimeSync asks for; returns the map's errors after 10 s [s] and how many there were."""
    rng = np.random.default_rng(seed)
    sync = TimeSync(clock)
    errors, count, host_s = [], 0, wire.start_s
    while host_s < wire.start_s + duration_s:
        answered_s = host_s + 0.5 * wire.fixed_s + rng.exponential(wire.jitter_s)
        received_s = answered_s + 0.5 * wire.fixed_s + rng.exponential(wire.jitter_s)
        clock.exchange(host_s, wire.vehicle(answered_s), received_s)
        count += 1
        host_s = received_s + sync.interval_s
        if host_s > wire.start_s + 10.0:
            errors.append(clock.to_host(wire.vehicle(host_s), host_s + 1.0) - host_s)
    return errors, count


@pytest.mark.parametrize(
    ("wire", "limit_s"),
    [
        (Wire(2e-4, 2e-4), 3e-4),  # Ethernet
        (Wire(1e-3, 5e-4), 5e-4),  # USB
        (Wire(10e-3, 5e-3), 3e-3),  # a radio
        (Wire(2e-3, 10e-3), 5e-3),  # a busy wireless network
    ],
)
def test_the_map_is_much_better_than_the_jitter(wire: Wire, limit_s: float) -> None:
    """RMS and bias over seeds stay well below what a single exchange would give, with few exchanges."""
    errors: list[float] = []
    for seed in range(4):
        found, count = run(wire, seed, 90.0, clock := ClockMap())
        errors += found
        assert clock.restarts == 0
        assert clock.drift == pytest.approx(-wire.drift, abs=2e-3)
        assert wire.fixed_s <= clock.round_trip_s < wire.fixed_s + 2.0 * wire.jitter_s
        assert count < 450
    assert np.sqrt(np.mean(np.square(errors))) < limit_s
    assert abs(np.mean(errors)) < 0.5 * limit_s


def test_a_quiet_link_slows_down_to_two_exchanges_a_second() -> None:
    """10 Hz at the start, 2 Hz once 20 exchanges in a row came out as predicted."""
    _, count = run(Wire(2e-4, 1e-4), 1, 60.0, ClockMap())
    assert 120 < count < 160


def test_a_simulator_that_runs_three_per_cent_slow_is_followed() -> None:
    """PX4's simulator on a busy host: the map stays within 2 ms although the clocks drift by 30 ms a second."""
    errors, _ = run(Wire(3e-4, 1e-4, drift=-0.03), 2, 40.0, ClockMap())
    assert max(map(abs, errors)) < 2e-3


def test_a_clock_of_coarse_ticks_is_followed_to_a_tick() -> None:
    """A vehicle whose clock ticks every 4 ms."""
    errors, _ = run(Wire(3e-4, 1e-4, tick_s=4e-3), 3, 40.0, ClockMap())
    assert np.percentile(np.abs(errors), 99) < 8e-3


def test_a_change_of_pace_is_caught_up_within_a_second() -> None:
    """The vehicle's clock suddenly runs 5 % slow: exchanges come at 10 Hz again, and the error falls below 3 ms."""
    clock = ClockMap()
    sync = TimeSync(clock)
    vehicle_s, host_s = 5.0, 1000.0
    error_s = 0.0
    for _ in range(600):
        clock.exchange(host_s - 1e-4, vehicle_s, host_s + 1e-4)
        interval_s = sync.interval_s
        vehicle_s += interval_s * (1.0 if host_s < 1030.0 else 0.95)
        host_s += interval_s
        error_s = clock.to_host(vehicle_s, host_s + 1.0) - host_s
        if host_s > 1032.0:
            assert abs(error_s) < 3e-3
        if host_s > 1035.0:
            break


def test_one_late_answer_does_not_move_the_map() -> None:
    """An exchange that took a second weighs next to nothing, an impossible one nothing."""
    clock = ClockMap()
    for index in range(40):
        sent_s = 1000.0 + 0.1 * index
        clock.exchange(sent_s, sent_s - 990.0, sent_s + 2e-4)
    before = clock.offset_s
    assert before is not None
    clock.exchange(1004.0, 1004.9 - 990.0, 1005.0)
    clock.exchange(1006.0, 20.0, 1005.0)
    after = clock.offset_s
    assert after == pytest.approx(before, abs=1e-4)
    assert clock.restarts == 0


def test_a_stepped_clock_restarts_the_map() -> None:
    """Three exchanges in a row that contradict it by far are believed."""
    clock = ClockMap()
    for index in range(20):
        clock.exchange(1000.0 + index, 10.0 + index, 1000.001 + index)
    for index in range(20, 23):
        assert clock.restarts == 0
        clock.exchange(1000.0 + index, 70.0 + index, 1000.001 + index)
    assert clock.restarts == 1
    assert clock.offset_s == pytest.approx(930.0005, abs=1e-6)


def test_before_the_first_answer_arrival_times_stand_in() -> None:
    """Marked by an unknown offset; vehicle time of setpoints is then 0."""
    clock = ClockMap()
    assert clock.offset_s is None
    assert not clock.synchronised
    assert clock.to_host(123.0, 1000.0) == 1000.0
    assert clock.to_vehicle(1000.0) == 0.0
    assert math.isnan(clock.round_trip_s)
    assert clock.offset_sigma_s == math.inf


def test_times_that_cannot_be_the_vehicles_clock_become_arrival_times() -> None:
    """UTC stamps, stale stamps and stamps of the future; true ones are kept and never lie after the arrival."""
    clock = ClockMap()
    clock.exchange(1000.0, 100.0, 1000.0)
    assert clock.to_host(99.9, 1000.0) == pytest.approx(999.9)
    assert clock.to_host(1.8e9, 1000.0) == 1000.0
    assert clock.to_host(30.0, 1000.0) == 1000.0
    assert clock.to_host(100.001, 1000.0) == 1000.0


def test_a_sample_that_waited_in_a_buffer_stays_as_old_as_it_is() -> None:
    """A process that was stopped for seconds must not take what it then finds for the present."""
    clock = ClockMap()
    clock.exchange(1000.0, 100.0, 1000.0)
    assert clock.to_host(95.0, 1000.0) == pytest.approx(995.0)


def test_setpoint_times_are_the_inverse_map() -> None:
    """Host to vehicle and back."""
    clock = ClockMap()
    run(Wire(2e-4, 1e-4, drift=-0.02), 4, 20.0, clock)
    vehicle_s = clock.to_vehicle(1020.0)
    assert clock.to_host(vehicle_s, 1021.0) == pytest.approx(1020.0, abs=1e-9)


def test_a_restart_of_the_vehicle_shows_as_time_going_back() -> None:
    """Three times in a row more than a second behind; a single late message is not enough."""
    clock = ClockMap()
    clock.exchange(1000.0, 100.0, 1000.0)
    assert not clock.watch(100.0)
    assert not clock.watch(90.0)
    assert not clock.watch(100.1)
    assert [clock.watch(time_s) for time_s in (2.0, 2.1, 2.2, 2.3)] == [False, False, True, False]
    assert not clock.synchronised
    assert clock.restarts == 1


def test_only_answers_to_own_requests_count() -> None:
    """The vehicle's own requests, answers to others and doubled answers change nothing; restarts are reported."""
    clock = ClockMap()
    sync = TimeSync(clock)
    request = json.loads(sync.request(7, 5_000_000_000))
    assert (request["tc1"], request["ts1"], request["target_system"]) == (0, 5_000_000_000, 7)
    sync.receive({"tc1": 0, "ts1": 60_000_000_000}, 5.0)
    sync.receive({"tc1": 60_000_000_000, "ts1": 4_999_999_999}, 5.0)
    assert not clock.synchronised
    sync.receive({"tc1": 60_000_000_000, "ts1": 5_000_000_000}, 5.002)
    sync.receive({"tc1": 60_000_000_000, "ts1": 5_000_000_000}, 5.5)
    assert clock.exchanges == 1
    assert clock.offset_s == pytest.approx(5.001 - 60.0)
    assert [sync.receive({"tc1": 0, "ts1": 1_000_000_000}, 6.0) for _ in range(3)] == [False, False, True]
