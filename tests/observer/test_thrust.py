from __future__ import annotations

import numpy as np
import pytest

from tests.observer.airframes import f550
from uasfly.airframe import GRAVITY_M_S2
from uasfly.observer.drive import hover_thrust_history
from uasfly.observer.thrust import ThrustHistory


def test_before_the_first_command_the_default_acts() -> None:
    """An empty history gives the default everywhere."""
    assert ThrustHistory(0.03, 9.8).mean(1.0, 2.0) == 9.8


def test_a_command_acts_after_its_delay() -> None:
    """Sent at 1 s with 30 ms of dead time it acts from 1.03 s on."""
    history = ThrustHistory(0.03, 9.8)
    history.add(1.0, 12.0)
    assert history.mean(1.0, 1.03) == 9.8
    assert history.mean(1.03, 1.05) == 12.0
    assert history.mean(1.02, 1.04) == pytest.approx(10.9)
    assert history.mean(1.05, 1.05) == 12.0


def test_the_mean_is_the_integral_over_the_steps() -> None:
    """Any interval of a piecewise-constant history agrees with fine sampling."""
    rng = np.random.default_rng(0)
    history = ThrustHistory(0.025, 9.8)
    times, values = np.sort(rng.uniform(0.0, 1.0, 30)), rng.uniform(5.0, 15.0, 30)
    for time_s, value in zip(times, values, strict=True):
        history.add(float(time_s), float(value))
    fine = np.linspace(0.0, 1.2, 1_200_001)
    acting = np.concatenate(((9.8,), values))[np.searchsorted(times + 0.025, fine, side="right")]
    for start_s, end_s in rng.uniform(0.0, 1.1, (20, 2)):
        low, high = min(start_s, end_s), max(start_s, end_s)
        inside = acting[(fine >= low) & (fine < high)]
        assert history.mean(low, high) == pytest.approx(inside.mean(), abs=1e-2)


def test_commands_may_come_in_any_order() -> None:
    """A late one is put where it belongs."""
    in_order, shuffled = ThrustHistory(0.0, 9.8), ThrustHistory(0.0, 9.8)
    commands = [(0.02 * k, 9.0 + 0.1 * k) for k in range(20)]
    for command in commands:
        in_order.add(*command)
    for k in np.random.default_rng(1).permutation(20):
        shuffled.add(*commands[k])
    assert in_order.mean(0.05, 0.31) == shuffled.mean(0.05, 0.31)


def test_a_long_flight_keeps_the_recent_past_only() -> None:
    """Ten minutes at 50 Hz: the last second is exact, the memory bounded."""
    history = ThrustHistory(0.03, 9.8)
    for k in range(30000):
        history.add(0.02 * k, float(k))
    assert history.mean(599.0, 599.02) == pytest.approx(29948.0, abs=1.0)
    assert len(history._entries) < 1000


def test_thrust_acts_after_its_own_delay() -> None:
    """Where the airframe file gives one; else after the common one."""
    airframe = f550()
    model = airframe.model
    for delay, expected in ((None, model.command_delay_s), (0.02, 0.02)):
        own = airframe.model_copy(update={"model": model.model_copy(update={"thrust_delay_s": delay})})
        history = hover_thrust_history(own)
        history.add(1.0, 12.0)
        assert history.mean(1.0, 1.0 + expected) == pytest.approx(GRAVITY_M_S2)
        assert history.mean(1.0 + expected, 2.0) == pytest.approx(12.0)


def test_a_correction_rescales_what_was_commanded_and_not_what_comes() -> None:
    """Nor what is assumed before the first command."""
    history = ThrustHistory(0.0, 9.8)
    history.add(1.0, 10.0)
    history.rescale(0.9)
    history.add(2.0, 12.0)
    assert history.mean(0.0, 0.5) == pytest.approx(9.8)
    assert history.mean(1.0, 1.5) == pytest.approx(9.0)
    assert history.mean(1.5, 2.5) == pytest.approx(0.5 * (9.0 + 12.0))
    history.rescale(1.0 / 0.9)
    assert history.mean(1.0, 1.5) == pytest.approx(10.0)
