"""The glide onto a reference: no step at its beginning or end, and consistent derivatives in between."""

from __future__ import annotations

import numpy as np

from uasfly.messages import ReferenceHorizon
from uasfly.trajectories.glide import Glide

GLIDE = Glide(np.array([0.2, -0.1, 0.05]), 0.1, start_s=5.0, duration_s=2.0)


def _still(times: np.ndarray) -> ReferenceHorizon:
    n = len(times)
    return ReferenceHorizon(times, np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n))


def test_it_begins_where_the_vehicle_is_and_ends_on_the_reference() -> None:
    """Full offset at the start, none at the end, at rest at both."""
    reference = GLIDE.onto(_still(np.array([5.0, 7.0])))
    np.testing.assert_allclose(reference.position_in_world, [GLIDE.offset_m, np.zeros(3)], atol=1e-12)
    np.testing.assert_allclose(reference.velocity_in_world, 0.0, atol=1e-12)
    np.testing.assert_allclose(reference.acceleration_in_world, 0.0, atol=1e-12)
    np.testing.assert_allclose(reference.yaw_rad, [0.1, 0.0], atol=1e-12)


def test_speed_and_acceleration_are_the_derivatives_of_position() -> None:
    """Checked by central differences, yaw too."""
    times = np.arange(4.9, 7.1, 1e-3)
    reference = GLIDE.onto(_still(times))
    position, speed = reference.position_in_world, reference.velocity_in_world
    np.testing.assert_allclose(np.gradient(position, times, axis=0)[1:-1], speed[1:-1], atol=1e-5)
    np.testing.assert_allclose(
        np.gradient(speed, times, axis=0)[1:-1], reference.acceleration_in_world[1:-1], atol=1e-3
    )
    np.testing.assert_allclose(np.gradient(reference.yaw_rad, times)[1:-1], reference.yaw_rate_rad_s[1:-1], atol=1e-5)


def test_afterwards_the_reference_is_untouched() -> None:
    """The very same object comes back."""
    reference = _still(np.array([7.0, 8.0]))
    assert GLIDE.onto(reference) is reference


def test_what_is_left_at_one_time_is_what_the_reference_gets() -> None:
    """Before, during and after."""
    times = np.array([4.0, 5.0, 5.3, 6.1, 6.999, 7.0, 9.0])
    for time in times:
        expected = GLIDE.onto(_still(np.array([time]))).position_in_world[0]
        np.testing.assert_allclose(GLIDE.offset_at(time), expected, atol=1e-15)
