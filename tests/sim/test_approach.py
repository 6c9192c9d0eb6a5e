from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.sim.approach import Approach, MotionLimits, braking_point

LIMITS = MotionLimits(5.0, 3.0, 1.5, 3.0, 2.0)
STEP = 0.008


def travelled(
    start: tuple[float, float, float], velocity: tuple[float, float, float], target: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities over 40 s."""
    path = Approach(start, velocity)
    positions, velocities = [], []
    for _ in range(5000):
        path.advance(target, LIMITS, STEP)
        positions.append(path.position)
        velocities.append(path.velocity)
    return np.array(positions), np.array(velocities)


def test_it_arrives_within_its_limits() -> None:
    """Far targets are reached without overshoot and without breaking speed or acceleration limits."""
    positions, velocities = travelled((0.0, 0.0, 20.0), (0.0, 0.0, 0.0), (30.0, -40.0, 5.0))
    assert positions[-1] == pytest.approx([30.0, -40.0, 5.0], abs=1e-3)
    assert np.hypot(velocities[:, 0], velocities[:, 1]).max() <= 5.0 + 1e-9
    assert velocities[:, 2].min() >= -1.5 - 1e-9
    change = np.diff(velocities, axis=0) / STEP
    assert np.hypot(change[:, 0], change[:, 1]).max() <= 3.0 + 1e-6
    assert np.abs(change[:, 2]).max() <= 2.0 + 1e-6
    assert positions[:, 0].max() <= 30.0 + 1e-3
    assert positions[:, 2].min() >= 5.0 - 1e-3


def test_climbing_has_its_own_limit() -> None:
    """Upwards the climb limit counts."""
    _, velocities = travelled((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 40.0))
    assert velocities[:, 2].max() == pytest.approx(3.0)


def test_position_is_the_integral_of_velocity() -> None:
    """Path and feed-forward belong together."""
    positions, velocities = travelled((1.0, 2.0, 3.0), (2.0, 1.0, -1.0), (5.0, 5.0, 5.0))
    middle = 0.5 * (velocities[1:] + velocities[:-1]) * STEP
    assert np.diff(positions, axis=0) == pytest.approx(middle, abs=1e-12)


def test_a_braking_vehicle_comes_to_rest_at_its_braking_point() -> None:
    """From any velocity the point comes to rest where the estimate says, within what the soft end costs."""
    start, velocity = (0.0, 0.0, 10.0), (4.0, -3.0, 1.0)
    rest = braking_point(start, velocity, LIMITS)
    assert rest == pytest.approx((4.0 * 5.0 / 6.0, -3.0 * 5.0 / 6.0, 10.25))
    positions, velocities = travelled(start, velocity, rest)
    assert positions[-1] == pytest.approx(rest, abs=1e-3)
    assert math.hypot(*velocities[-1]) < 1e-3
