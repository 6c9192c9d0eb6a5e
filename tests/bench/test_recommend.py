"""What is recommended for made-up computers."""

from __future__ import annotations

import pytest

from tests.control.vehicle import f550
from uasfly.bench.recommend import HOLDS_SHARE, RATES_HZ, SET_SHARE, cycle_p99_ms, holdable_rate, recommend

SETTINGS = f550().controller
FAST = {10: 0.05, 20: 0.07, 30: 0.1, 40: 0.15, 60: 0.2, 160: 1.0}


def test_a_fast_computer_keeps_the_airframes_rate_and_gets_the_most_nodes() -> None:
    """Nothing is gained beyond 60 nodes or beyond the rate that the weights are tuned for."""
    found = recommend(SETTINGS, FAST, 1.5)
    assert found is not None
    assert (found.horizon_s, found.nodes, found.rate_hz, found.fits) == (3.0, 60, 50.0, True)
    assert found.holds_hz == 100.0


def test_a_slower_computer_gets_fewer_nodes_or_a_lower_rate() -> None:
    """From fast to slow: first the nodes go down, then the rate; a cycle never takes more than its share."""
    last = (1000.0, 1000)
    for slowness in (1.0, 5.0, 20.0, 40.0, 80.0, 160.0, 320.0):
        costs = {n: slowness * cost for n, cost in FAST.items()}
        found = recommend(SETTINGS, costs, 1.5)
        assert found is not None
        assert found.rate_hz <= last[0]
        assert found.rate_hz < last[0] or found.nodes <= last[1]
        cycle = cycle_p99_ms(found.nodes, costs, 1.5)
        assert cycle is not None
        assert found.fits
        assert cycle <= SET_SHARE * 1e3 / found.rate_hz
        last = (found.rate_hz, found.nodes)
    assert last[0] < 50.0


def test_a_hopeless_computer_is_told_so() -> None:
    """The least of everything is still too much: the reason says what to do."""
    found = recommend(SETTINGS, {10: 500.0, 60: 900.0}, 1.5)
    assert found is not None
    assert not found.fits
    assert "too slow" in found.why


def test_nodes_leave_the_first_interval_its_length() -> None:
    """40 nodes of at least 0.1 s do not fit into 3 s."""
    found = recommend(SETTINGS.model_copy(update={"first_interval_s": 0.1}), FAST, 1.5)
    assert found is not None
    assert found.nodes == 30


def test_sizes_that_were_not_measured_cost_what_the_next_larger_one_does() -> None:
    """Only 30 was measured: 20 is taken to cost as much, 40 is not recommended."""
    assert cycle_p99_ms(20, {30: 0.1}, 1.0) == pytest.approx(1.1)
    assert cycle_p99_ms(40, {30: 0.1}, 1.0) is None
    found = recommend(SETTINGS, {30: 0.1}, 1.0)
    assert found is not None
    assert found.nodes == 30
    assert recommend(SETTINGS, {}, 1.0) is None


@pytest.mark.parametrize("cycle_ms", [0.5, 4.9, 5.1, 9.9, 13.0, 60.0])
def test_the_rate_that_is_held_leaves_half_of_its_period(cycle_ms: float) -> None:
    """And the next higher one does not."""
    rate = holdable_rate(cycle_ms)
    assert cycle_ms <= HOLDS_SHARE * 1e3 / rate
    higher = [other for other in RATES_HZ if other > rate]
    assert not higher or cycle_ms > HOLDS_SHARE * 1e3 / min(higher)
