"""Position and velocity held against each other, without a model."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from uasfly.observer.agreement import APART_M, Agreement
from uasfly.observer.door import Odometry

DT_S = 0.01
SIGMA_M = 0.015
Vector = tuple[float, float, float]
Motion = Callable[[float], Vector]


def _run(agreement: Agreement, position: Motion, velocity: Motion, begin_s: float, end_s: float) -> list[bool]:
    """Samples at 100 Hz with PX4's noise; what is said after each."""
    rng = np.random.default_rng(4)
    said = []
    for k in range(round(begin_s / DT_S), round(end_s / DT_S)):
        time_s = k * DT_S
        p = (np.array(position(time_s)) + rng.normal(0.0, SIGMA_M, 3)).tolist()
        v = (np.array(velocity(time_s)) + rng.normal(0.0, 0.02, 3)).tolist()
        agreement.look(
            Odometry(time_s, p, v, [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], (1.0, 1.0, 1.0)),
            SIGMA_M,
        )
        said.append(agreement.agrees)
    return said


def _still(_: float) -> Vector:
    return 0.0, 0.0, 0.0


def test_the_hardest_push_is_motion() -> None:
    """15 m/s^2 from one sample to the next, up to 6 m/s: position and velocity agree throughout."""

    def speed(time_s: float) -> float:
        return min(6.0, 15.0 * max(0.0, time_s - 1.0))

    def way(time_s: float) -> float:
        pushed_s = max(0.0, time_s - 1.0)
        return 7.5 * pushed_s**2 if pushed_s < 0.4 else 1.2 + 6.0 * (pushed_s - 0.4)

    said = _run(Agreement(), lambda t: (way(t), 0.0, 0.0), lambda t: (speed(t), 0.0, 0.0), 0.0, 3.0)
    assert all(said)


@pytest.mark.parametrize("jump_m", [0.5, 8.0])
def test_a_position_that_jumps_disagrees_at_once_and_for_two_seconds(jump_m: float) -> None:
    """With the first sample after the jump; then the new place is as good as the old one."""
    said = _run(Agreement(), lambda t: (0.0, jump_m if t >= 1.0 else 0.0, 0.0), _still, 0.0, 4.0)
    assert all(said[:99])
    assert not any(said[100:295])
    assert all(said[310:])


@pytest.mark.parametrize(("wrong_m_s", "within_s"), [(2.0, 0.12), (5.0, 0.06)])
def test_a_velocity_that_the_position_does_not_follow_disagrees_soon(wrong_m_s: float, within_s: float) -> None:
    """And as long as it lasts."""
    said = _run(Agreement(), _still, lambda t: (0.0, 0.0, wrong_m_s if t >= 1.0 else 0.0), 0.0, 5.0)
    assert all(said[:99])
    assert not any(said[100 + round(within_s / DT_S) :])


def test_noise_disagrees_with_nobody() -> None:
    """Half a minute of hover."""
    assert all(_run(Agreement(), _still, _still, 0.0, 30.0))


def test_noisier_positions_are_given_more_room() -> None:
    """A step of 0.2 m is news at 1.5 cm of noise, and none at 5 cm."""
    for sigma, agrees in ((SIGMA_M, False), (0.05, True)):
        agreement = Agreement()
        for k in range(20):
            position = [0.2 if k >= 10 else 0.0, 0.0, 0.0]
            agreement.look(Odometry(k * DT_S, position, [0.0] * 3, [1.0, 0, 0, 0], None, (1.0, 1.0, 1.0)), sigma)
        assert agreement.agrees is agrees
        assert agreement.apart_m == pytest.approx(0.2)
    assert APART_M < 0.2


def test_without_one_of_them_nothing_is_said_against_the_other() -> None:
    """A velocity that is missing begins the comparison anew; a position that is missing leaves it as it was."""
    agreement = Agreement()
    _run(agreement, lambda t: (0.0, 3.0 if t >= 0.5 else 0.0, 0.0), _still, 0.0, 0.7)
    assert not agreement.agrees
    nothing = [0.0, 0.0, 0.0]
    agreement.look(Odometry(0.7, nothing, nothing, [1.0, 0, 0, 0], None, (1.0, 0.0, 1.0)), SIGMA_M)
    assert not agreement.agrees
    agreement.look(Odometry(0.71, nothing, nothing, [1.0, 0, 0, 0], None, (1.0, 1.0, 0.0)), SIGMA_M)
    assert agreement.agrees
    assert math.isfinite(agreement.apart_m)
