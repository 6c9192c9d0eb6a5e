"""The yaw PID and its setpoint."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.airframe import Pid
from uasfly.control.yaw import LEASH_RAD, YawController
from uasfly.frames import wrap_angle

PERIOD_S = 0.02
GAINS = Pid(kp=1.5, ki=0.0, kd=0.1, integral_limit=0.2)
LIMIT = math.radians(60.0)


def _fly(
    controller: YawController,
    reference: float,
    rate: float,
    seconds: float,
    *,
    yaw: float = 0.0,
    gain: float = 2.8,
    heading_offset: float = 0.0,
) -> list[tuple[float, float, float]]:
    """Time, yaw and error under PX4's yaw loop; `heading_offset` is how far PX4's heading is from ours."""
    rows, turning = [], 0.0
    for step in range(round(seconds / PERIOD_S)):
        time = step * PERIOD_S
        wanted = reference + rate * time
        setpoint, forward = controller.step(time, yaw, turning, wanted, rate)
        assert abs(forward) <= LIMIT + 1e-12
        turning = gain * wrap_angle(setpoint - yaw - heading_offset) + forward if gain else 0.0
        yaw = wrap_angle(yaw + PERIOD_S * turning)
        rows.append((time, yaw, wrap_angle(wanted + rate * PERIOD_S - yaw)))
    return rows


def test_a_turning_reference_is_followed_without_lag() -> None:
    """0.5 rad/s of reference through several revolutions: under 0.1 deg of error once settled."""
    rows = _fly(YawController(GAINS, LIMIT), 0.0, 0.5, 30.0)
    assert max(abs(error) for time, _, error in rows if time > 1.0) < math.radians(0.1)


def test_the_short_way_round_is_taken() -> None:
    """From 170 to -170 degrees it turns 20 degrees to the left, never through zero."""
    rows = _fly(YawController(GAINS, LIMIT), math.radians(-170.0), 0.0, 8.0, yaw=math.radians(170.0))
    assert all(abs(yaw) > math.radians(165.0) for _, yaw, _ in rows)
    assert abs(rows[-1][2]) < math.radians(0.1)


def test_a_far_reference_is_reached_at_the_limit_without_overshoot() -> None:
    """170 degrees away: it turns no faster than the limit and does not swing past by more than a degree."""
    rows = _fly(YawController(GAINS, LIMIT), math.radians(170.0), 0.0, 12.0)
    speeds = np.abs(np.diff([yaw for _, yaw, _ in rows])) / PERIOD_S
    assert speeds.max() < 1.1 * LIMIT
    assert min(error for _, _, error in rows) > -math.radians(1.0)
    assert abs(rows[-1][2]) < math.radians(0.1)


def test_an_offset_of_the_vehicles_heading_vanishes() -> None:
    """PX4 believes another heading by 5 degrees: the setpoint moves until our error is zero, with no integral gain."""
    rows = _fly(YawController(GAINS, LIMIT), 0.3, 0.0, 12.0, heading_offset=math.radians(5.0))
    assert abs(rows[-1][2]) < math.radians(0.1)


def test_the_setpoint_waits_for_a_vehicle_that_does_not_turn() -> None:
    """A vehicle that is held does not wind the setpoint up."""
    controller = YawController(GAINS, LIMIT)
    _fly(controller, 2.0, 0.0, 10.0, gain=0.0)
    assert controller.setpoint_rad is not None
    assert abs(controller.setpoint_rad) <= LEASH_RAD + 1e-9


def test_taking_over_continues_the_setpoint() -> None:
    """After a reset the first setpoint is the one handed over, or the measured yaw where there is none."""
    controller = YawController(GAINS, LIMIT)
    controller.reset(0.2)
    assert controller.step(5.0, 0.1, 0.0, 0.9, 0.0)[0] == pytest.approx(0.2)
    controller.reset(None)
    assert controller.step(5.0, 0.1, 0.0, 0.9, 0.0)[0] == pytest.approx(0.1)


def test_without_a_measurement_it_goes_on_with_the_reference_rate() -> None:
    """NaN for the yaw: the setpoint turns as the reference does; NaN for everything: it stands still."""
    controller = YawController(GAINS, LIMIT)
    controller.step(0.0, 0.1, 0.0, 0.1, 0.3)
    setpoint, rate = controller.step(0.1, math.nan, math.nan, 0.13, 0.3)
    assert rate == pytest.approx(0.3)
    assert setpoint == pytest.approx(0.13)
    setpoint, rate = controller.step(0.2, math.nan, math.nan, math.nan, math.nan)
    assert setpoint == pytest.approx(0.13)
    assert rate == 0.0


def test_the_integral_is_limited_and_does_not_wind_up_at_the_limit() -> None:
    """With an integral gain the correction of a lasting error stays within the integral's limit."""
    gains = Pid(kp=0.0, ki=1.0, kd=0.0, integral_limit=0.2)
    controller = YawController(gains, LIMIT)
    for step in range(500):
        _, rate = controller.step(step * PERIOD_S, 0.0, 0.0, 0.5, 0.0)
    assert rate == pytest.approx(0.2)


def test_the_predicted_error_is_what_happens() -> None:
    """The decay that the horizon assumes, from 170 degrees and from 10, is the closed loop's to a few degrees."""
    for start in (math.radians(170.0), math.radians(10.0)):
        controller = YawController(Pid(kp=1.5, ki=0.0, kd=0.0, integral_limit=0.0), LIMIT)
        rows = _fly(controller, start, 0.0, 3.0)
        predicted = controller.remaining_error(start, np.array([time + PERIOD_S for time, _, _ in rows]))
        assert np.abs(predicted - [error for _, _, error in rows]).max() < 0.06 * start


def test_the_predicted_error_is_odd_and_starts_where_it_is() -> None:
    """Left and right are alike; at time zero the error is the present one."""
    controller = YawController(GAINS, LIMIT)
    times = np.linspace(0.0, 3.0, 31)
    for error in (0.1, 2.9):
        ahead = controller.remaining_error(error, times)
        assert ahead[0] == pytest.approx(error)
        np.testing.assert_allclose(controller.remaining_error(-error, times), -ahead)
        assert np.all(np.diff(ahead) < 0.0)
