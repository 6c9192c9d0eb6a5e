"""The position PID."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.vehicle import f550
from uasfly.control.backup import PositionPid

AIRFRAME = f550()
ZERO = np.zeros(3)
K = 28.54209


def _pid() -> PositionPid:
    return PositionPid(AIRFRAME.backup, AIRFRAME.model, AIRFRAME.limits)


def test_at_rest_on_the_reference_it_hovers() -> None:
    """No error, no tilt, hover thrust."""
    inputs = _pid().step(0.02, ZERO, ZERO, ZERO, ZERO, 0.7, K)
    np.testing.assert_allclose(inputs, (AIRFRAME.model.hover_thrust, 0.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_the_commands_give_the_wanted_acceleration(yaw: float) -> None:
    """Gains times errors plus the reference acceleration is what the model then does, at any yaw, moving too."""
    pid = _pid()
    position_error, velocity_error = np.array((0.1, -0.2, 0.05)), np.array((-0.1, 0.1, 0.2))
    velocity, acceleration = np.array((0.8, -0.4, 0.1)), np.array((0.3, 0.2, -0.1))
    inputs = pid.step(0.0, position_error, velocity_error, velocity, acceleration, yaw, K)
    flown = pid.acceleration_of((inputs[0], inputs[1], inputs[2]), velocity, yaw)
    wanted = acceleration + np.array((4.0, 4.0, 6.0)) * position_error + np.array((3.0, 3.0, 4.0)) * velocity_error
    np.testing.assert_allclose(flown, wanted, atol=1e-6)


def test_a_weak_battery_gets_more_thrust() -> None:
    """At nine tenths of k_thrust the hover command is a ninth larger."""
    inputs = _pid().step(0.02, ZERO, ZERO, ZERO, ZERO, 0.0, 0.9 * K)
    assert inputs[0] == pytest.approx(AIRFRAME.model.hover_thrust / 0.9)


def test_the_integral_grows_with_the_error_and_stops_at_its_limit() -> None:
    """0.1 m for a second is 0.15 m/s^2 at a gain of 1.5; after a minute it is the limit."""
    pid = _pid()
    error = np.array((0.1, 0.0, 0.0))
    for _ in range(50):
        pid.step(0.02, error, ZERO, ZERO, ZERO, 0.0, K)
    np.testing.assert_allclose(pid.integral, (0.15, 0.0, 0.0), atol=1e-9)
    for _ in range(3000):
        pid.step(0.02, error, ZERO, ZERO, ZERO, 0.0, K)
    np.testing.assert_allclose(pid.integral, (3.0, 0.0, 0.0))


def test_at_the_tilt_limit_the_integral_waits() -> None:
    """Five metres away it leans as far as it may and the blocked axis does not wind up; the free ones go on."""
    pid = _pid()
    error = np.array((5.0, 0.0, 0.1))
    for _ in range(50):
        inputs = pid.step(0.02, error, ZERO, ZERO, ZERO, 0.0, K)
    assert inputs[2] == pytest.approx(AIRFRAME.limits.tilt_rad)
    assert pid.integral[0] == 0.0
    assert pid.integral[2] == pytest.approx(0.2)


def test_an_integral_that_helps_out_of_saturation_still_moves() -> None:
    """Leaning at the limit the wrong way round, the integral may shrink."""
    pid = _pid()
    pid.reset(np.array((3.0, 0.0, 0.0)))
    pid.step(0.02, np.array((-0.1, 0.0, 0.0)), np.array((4.0, 0.0, 0.0)), ZERO, ZERO, 0.0, K)
    assert pid.integral[0] < 3.0


def test_what_is_not_finite_counts_as_no_error() -> None:
    """NaN in errors and velocity: level, hover, and the integral untouched and still acting."""
    pid = _pid()
    pid.reset(np.array((0.5, np.nan, np.inf)))
    nan = np.full(3, np.nan)
    inputs = pid.step(0.02, nan, nan, nan, nan, 0.0, K)
    assert np.all(np.isfinite(inputs))
    np.testing.assert_array_equal(pid.integral, (0.5, 0.0, 0.0))
    assert inputs[2] == pytest.approx(np.arctan2(0.5, 9.80665) / AIRFRAME.model.pitch.gain)


def test_a_long_pause_is_not_integrated() -> None:
    """After ten seconds without a step the integral grows by a fifth of a second at most."""
    pid = _pid()
    pid.step(10.0, np.array((0.1, 0.0, 0.0)), ZERO, ZERO, ZERO, 0.0, K)
    assert pid.integral[0] == pytest.approx(1.5 * 0.1 * 0.2)
