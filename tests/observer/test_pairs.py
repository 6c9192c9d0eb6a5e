"""Odometry that came together counts as one sample."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler
from uasfly.messages import AttitudeTargetSample, OdometrySample
from uasfly.observer.pairs import paired


def odometry(time_s: float, roll_rad: float = 0.0, speed_m_s: float = 0.0, resets: int = 0) -> OdometrySample:
    """Flying east at a speed, turned about the nose."""
    quaternion = quaternion_from_euler(roll_rad, 0.0, 0.3)
    place = np.array((speed_m_s * time_s, 0.0, 2.0))
    return OdometrySample(time_s, place, np.array((speed_m_s, 0.0, 0.0)), quaternion, np.array((0.0, 0.1, 0.0)), resets)


TARGET = AttitudeTargetSample(1.005, np.array((1.0, 0.0, 0.0, 0.0)), 0.5)


def test_two_neighbours_become_their_mean() -> None:
    """Time, place, velocity and attitude are those in the middle; what came between the two comes before it."""
    result = paired((odometry(1.0, 0.10, 3.0), TARGET, odometry(1.01, 0.12, 3.0)))
    assert result[0] is TARGET
    mean = result[1]
    assert isinstance(mean, OdometrySample)
    assert len(result) == 2
    assert mean.time_s == pytest.approx(1.005)
    assert mean.position_in_world == pytest.approx((3.015, 0.0, 2.0))
    assert mean.velocity_in_world == pytest.approx((3.0, 0.0, 0.0))
    assert mean.quaternion_body_to_world == pytest.approx(quaternion_from_euler(0.11, 0.0, 0.3), abs=1e-4)


def test_the_sign_of_a_quaternion_means_nothing() -> None:
    """The mean of q and -q is q."""
    one, other = odometry(1.0, 0.1), odometry(1.01, 0.1)
    turned = dataclasses.replace(other, quaternion_body_to_world=-other.quaternion_body_to_world)
    (mean,) = paired((one, turned))
    assert isinstance(mean, OdometrySample)
    assert mean.quaternion_body_to_world == pytest.approx(one.quaternion_body_to_world)


def test_four_become_two_and_three_leave_one() -> None:
    """Each counts once, in the order of time."""
    samples = tuple(odometry(1.0 + 0.01 * k) for k in range(4))
    assert [sample.time_s for sample in paired(samples)] == pytest.approx([1.005, 1.025])
    assert [sample.time_s for sample in paired(samples[:3])] == pytest.approx([1.005, 1.02])


@pytest.mark.parametrize(
    "second",
    [
        odometry(1.05),
        odometry(1.0),
        odometry(0.99),
        odometry(1.01, resets=1),
        odometry(1.01, roll_rad=math.nan),
        odometry(1.01, speed_m_s=math.inf),
    ],
)
def test_what_does_not_belong_together_stays_apart(second: OdometrySample) -> None:
    """Far apart in time, twice the same time, backwards, a jump of PX4's estimator between, something not finite."""
    samples = (odometry(1.0), second)
    assert list(paired(samples)) == list(samples)


def test_without_a_second_one_nothing_changes() -> None:
    """A single sample, or none."""
    assert list(paired(())) == []
    alone = (TARGET, odometry(1.0))
    assert all(kept is given for kept, given in zip(paired(alone), alone, strict=True))
