"""The horizontal force that the accelerometer feels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.messages import AccelerometerSample, Array
from uasfly.wind.direct_kernel import FELT_SAMPLES, FELT_STEP_S
from uasfly.wind.felt_force import FeltForce, horizontal_force

ATTITUDES = np.array([quaternion_from_euler(0.3, -0.4, 1.2), quaternion_from_euler(-0.1, 0.2, -2.0)])


def test_it_is_the_thrust_free_force() -> None:
    """H = a_h - s a_z of all that pushes, whatever the thrust."""
    in_plane = np.array(((1.0, -0.5), (0.3, 0.8)))
    for thrust in (3.0, 15.0):
        for row, (force, attitude) in enumerate(zip(in_plane, ATTITUDES, strict=True)):
            rotation = rotation_matrix(attitude)
            pushed = rotation @ (*force, thrust)
            slope = rotation[:2, 2] / rotation[2, 2]
            expected = pushed[:2] - slope * pushed[2]
            np.testing.assert_allclose(horizontal_force(in_plane, ATTITUDES)[row], expected, atol=1e-12)


def felt(forces: Array, begin_s: float = 10.0) -> FeltForce:
    """After samples (n, 2) every 20 ms, level and facing east."""
    result = FeltForce()
    for k, (x, y) in enumerate(forces.tolist()):
        result.add(AccelerometerSample(begin_s + FELT_STEP_S * k, np.array((x, y, 9.8))))
    times: Array = begin_s + 0.01 * np.arange(2.0 * len(forces), dtype=np.float64)
    result.take(times, np.tile((1.0, 0.0, 0.0, 0.0), (len(times), 1)))
    return result


def test_what_it_keeps_is_told_on_a_grid() -> None:
    """A ramp comes back as a ramp, oldest first."""
    ramp = 0.1 * np.column_stack((np.arange(100.0), -np.arange(100.0)))
    told = felt(ramp)
    assert told.newest_s(12.0) == pytest.approx(11.98)
    np.testing.assert_allclose(told.up_to(11.98), ramp[-FELT_SAMPLES:], atol=1e-9)


def test_its_noise_is_found_without_what_the_force_walks() -> None:
    """White noise of 0.15 on a walk of 1 m/s^2/sqrt(s), within 15 %."""
    rng = np.random.default_rng(4)
    walk = np.cumsum(math.sqrt(FELT_STEP_S) * rng.standard_normal((78, 2)), axis=0)
    sigmas = [felt(walk + 0.15 * rng.standard_normal(walk.shape)).sigma_m_s2(1.0) for _ in range(20)]
    assert np.mean(sigmas) == pytest.approx(0.15, rel=0.15)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e30])
def test_gaps_and_garbage_tell_nothing(bad: float) -> None:
    """Too short, stopped, or with a hole of garbage in the middle."""
    whole = np.zeros((100, 2))
    assert felt(whole).newest_s(11.99) is not None
    assert felt(whole[:60]).newest_s(11.19) is None
    assert felt(whole).newest_s(12.2) is None
    holed = whole.copy()
    holed[60:70] = bad
    assert felt(holed).newest_s(11.99) is None
    assert FeltForce().newest_s(0.0) is None


def test_a_sample_ahead_of_the_attitude_waits() -> None:
    """It is worked off with the next attitudes; what was forgotten is gone."""
    told = felt(np.zeros((100, 2)))
    told.add(AccelerometerSample(12.01, np.array((1.0, 0.0, 9.8))))
    level = np.array(((1.0, 0.0, 0.0, 0.0),))
    told.take(np.array((12.0,)), level)
    assert told.newest_s(12.0) == pytest.approx(11.98)
    told.take(np.array((12.02,)), level)
    assert told.newest_s(12.02) == pytest.approx(12.01)
    told.add(AccelerometerSample(1e6, np.zeros(3)))  # a wrong time is not waited for
    told.add(AccelerometerSample(math.nan, np.zeros(3)))
    told.take(np.array((12.04,)), level)
    told.take(np.array((1e6 + 1.0,)), level)
    assert told.newest_s(12.03) == pytest.approx(12.01)
    told.forget()
    assert told.newest_s(12.02) is None
