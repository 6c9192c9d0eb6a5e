"""Tilt against the wind's drag."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.wind.compensation import tilt_offsets


@pytest.mark.parametrize("yaw", [0.0, 0.8, -2.5])
@pytest.mark.parametrize("drag", [(1.5, 0.0, 0.0), (-0.7, 2.0, 0.4), (0.0, 0.0, 1.0)])
def test_the_thrust_balances_the_drag(yaw: float, drag: tuple[float, float, float]) -> None:
    """At that roll and pitch the thrust's horizontal part is the drag's opposite, at any heading."""
    roll, pitch = tilt_offsets(np.array(drag), yaw, 10.0)
    thrust = rotation_matrix(quaternion_from_euler(roll, pitch, yaw)) @ np.array((0.0, 0.0, 10.0))
    np.testing.assert_allclose(thrust[:2], (-drag[0], -drag[1]), atol=1e-9)


def test_small_drag_takes_a_tilt_of_drag_over_thrust() -> None:
    """Wind from behind raises the nose, wind from the right leans right: 1 m/s^2 at 10 m/s^2 are 5.7 deg."""
    assert tilt_offsets(np.array((1.0, 0.0, 0.0)), 0.0, 10.0) == pytest.approx((0.0, -math.asin(0.1)))
    assert tilt_offsets(np.array((0.0, 1.0, 0.0)), 0.0, 10.0) == pytest.approx((math.asin(0.1), 0.0))


def test_more_drag_than_thrust_is_no_error() -> None:
    """A wish beyond what thrust can give lies flat."""
    roll, pitch = tilt_offsets(np.array((30.0, 30.0, 0.0)), 0.0, 10.0)
    assert roll == pytest.approx(0.5 * math.pi)
    assert math.isfinite(pitch)
