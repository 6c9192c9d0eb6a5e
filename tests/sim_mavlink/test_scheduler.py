from collections import Counter

import pytest

from tests.sim_mavlink.fakes import FakeVehicle
from uasfly.sim.mavlink.scheduler import RETRY_S, Scheduler, Stream
from uasfly.sim.mavlink.vehicle_view import VehicleView


def _counts(scheduler: Scheduler, vehicle: FakeVehicle, duration_s: float, turn_s: float = 0.004) -> Counter[int]:
    view, counter = VehicleView(vehicle), Counter[int]()
    for _ in range(round(duration_s / turn_s)):
        vehicle.time_s += turn_s
        counter.update(scheduler.collect(view))
    return counter


def _stream(number: int, rate_hz: float, max_rate_hz: float = 250.0) -> Stream:
    return Stream(number, rate_hz, lambda _: number, max_rate_hz)


@pytest.mark.parametrize("rate_hz", [0.5, 1.0, 8.0, 30.0, 50.0, 100.0, 250.0])
def test_rates_are_kept_on_average(rate_hz: float) -> None:
    """Intervals that are no multiple of the step come out right over time."""
    sent = _counts(Scheduler([_stream(1, rate_hz)]), FakeVehicle(), 20.0)
    assert sent[1] == pytest.approx(20.0 * rate_hz, abs=1.0)


def test_a_stream_without_a_rate_is_off_until_asked_for() -> None:
    """Rate 0 sends nothing; an interval switches it on, a negative one off again."""
    scheduler, vehicle = Scheduler([_stream(1, 0.0)]), FakeVehicle()
    assert _counts(scheduler, vehicle, 1.0)[1] == 0
    assert scheduler.interval_us(1) == -1
    assert scheduler.set_interval(1, 20000.0, vehicle.time_s)
    assert _counts(scheduler, vehicle, 1.0)[1] == pytest.approx(50, abs=1)
    assert scheduler.interval_us(1) == 20000
    scheduler.set_interval(1, -1.0, vehicle.time_s)
    assert _counts(scheduler, vehicle, 1.0)[1] == 0


def test_interval_zero_is_the_default() -> None:
    """SET_MESSAGE_INTERVAL with 0 restores the default rate."""
    scheduler, vehicle = Scheduler([_stream(1, 10.0)]), FakeVehicle()
    scheduler.set_interval(1, 10000.0, 0.0)
    scheduler.set_interval(1, 0.0, 0.0)
    assert _counts(scheduler, vehicle, 2.0)[1] == pytest.approx(20, abs=1)


def test_a_rate_is_cut_at_the_highest_one() -> None:
    """What PX4 cannot send faster is sent as fast as it can."""
    scheduler, vehicle = Scheduler([_stream(1, 10.0, max_rate_hz=100.0)]), FakeVehicle()
    scheduler.set_interval(1, 1.0, 0.0)
    assert _counts(scheduler, vehicle, 1.0)[1] == pytest.approx(100, abs=1)
    assert scheduler.interval_us(1) == 10000


def test_an_unknown_stream_has_no_interval() -> None:
    """Setting it fails, asking for it gives -1."""
    scheduler = Scheduler([_stream(1, 10.0)])
    assert not scheduler.set_interval(2, 10000.0, 0.0)
    assert scheduler.interval_us(2) == -1


def test_what_was_held_up_does_not_come_in_a_burst() -> None:
    """After a second of silence a stream sends once and goes on at its rate."""
    scheduler, vehicle = Scheduler([_stream(1, 50.0)]), FakeVehicle()
    view = VehicleView(vehicle)
    scheduler.collect(view)
    vehicle.time_s = 1.0
    assert scheduler.collect(view) == [1]
    assert scheduler.collect(view) == []
    assert scheduler.next_due_s == pytest.approx(1.02)


def test_a_stream_without_news_stays_due() -> None:
    """It is asked again soon, so that news go out at once although the interval is long."""
    news: list[int] = []
    scheduler = Scheduler([Stream(1, 0.5, lambda _: news.pop() if news else None, 250.0)])
    vehicle = FakeVehicle()
    assert _counts(scheduler, vehicle, 0.5)[1] == 0
    news.append(1)
    assert _counts(scheduler, vehicle, RETRY_S + 0.004)[1] == 1
