"""The mission's time along the clock: smooth between paces, and the same however it is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from uasfly.messages import Array, ReferenceHorizon
from uasfly.trajectories.pacing import CHANGE_S, Pacing

TIMES = np.linspace(9.0, 16.0, 141)


class Wave:
    """A reference whose derivatives by its own time are known."""

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """A sine along x, a parabola along y."""
        zero = np.zeros_like(times_s)
        return ReferenceHorizon(
            times_s,
            np.stack((np.sin(times_s), times_s**2, zero), axis=1),
            np.stack((np.cos(times_s), 2.0 * times_s, zero), axis=1),
            np.stack((-np.sin(times_s), zero + 2.0, zero), axis=1),
            0.1 * times_s,
            zero + 0.1,
        )


def paced(before: float, after: float) -> Pacing:
    """From one pace to another at 10 s."""
    pacing = Pacing(5.0, 1.0, before)
    pacing.change(10.0, after)
    return pacing


@pytest.mark.parametrize(("before", "after"), [(1.0, 1.0), (1.0, 0.0), (0.0, 0.4), (0.4, -0.4), (0.4, 0.4)])
def test_derivatives_by_the_clock_are_those_of_the_position(before: float, after: float) -> None:
    """By central differences, from the old pace on over the change to the new one; yaw too."""
    pacing = paced(before, after)
    times = np.arange(10.0, 13.0, 1e-4)  # the jerk has steps of up to 40 m/s^3, half a step of which is seen here
    reference = pacing.onto(Wave(), times)
    for value, derivative in (
        (reference.position_in_world, reference.velocity_in_world),
        (reference.velocity_in_world, reference.acceleration_in_world),
        (reference.yaw_rad, reference.yaw_rate_rad_s),
    ):
        np.testing.assert_allclose(np.gradient(value, times, axis=0)[1:-1], derivative[1:-1], atol=2e-3)


@pytest.mark.parametrize(("before", "after"), [(1.0, 1.0), (1.0, 0.0), (0.4, -0.4)])
def test_one_time_many_times_and_a_steady_pace_agree(before: float, after: float) -> None:
    """The shortcuts for a single time, and for horizons after the change, give what the whole horizon gives."""
    pacing = paced(before, after)
    whole = pacing.onto(Wave(), TIMES)
    for index, time_s in enumerate(TIMES):
        assert pacing.mission_time_s(time_s) == pytest.approx(np.sqrt(whole.position_in_world[index, 1]), abs=1e-9)
        assert pacing.pace(time_s) == pytest.approx(10.0 * whole.yaw_rate_rad_s[index], abs=1e-12)
    late = TIMES >= 10.0 + CHANGE_S
    steady = pacing.onto(Wave(), TIMES[late])
    np.testing.assert_array_equal(steady.time_s, TIMES[late])
    for name in ("position_in_world", "velocity_in_world", "acceleration_in_world", "yaw_rad", "yaw_rate_rad_s"):
        np.testing.assert_allclose(getattr(steady, name), getattr(whole, name)[late], atol=1e-9)
