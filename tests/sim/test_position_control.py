from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.frames import euler_from_quaternion, rotation_matrix
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.position_control import AttitudeSetpoint, HoverThrust, MotionSetpoint, PositionControl

STILL = (0.0, 0.0, 0.0)
WIDE = math.radians(45.0)
STEP = 0.008


def controller(**changes: float) -> PositionControl:
    """A controller with PX4's gains."""
    return PositionControl(ParameterTable(changes), STEP)


def axis(setpoint: AttitudeSetpoint) -> np.ndarray:
    """Direction of the thrust in the world."""
    return rotation_matrix(np.array(setpoint.attitude))[:, 2]


def test_at_the_target_it_hovers() -> None:
    """Without errors the answer is level flight at hover thrust, with the heading asked for."""
    answer = controller().update(MotionSetpoint((1.0, 2.0, 3.0), STILL, 0.7), (1.0, 2.0, 3.0), STILL, 0.34, WIDE)
    assert answer.thrust == pytest.approx(0.34)
    assert euler_from_quaternion(np.array(answer.attitude)) == pytest.approx((0.0, 0.0, 0.7))


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_it_leans_towards_the_target_whatever_the_heading(yaw: float) -> None:
    """The thrust leans towards the target, carries the weight besides, and the heading stays."""
    answer = controller().update(MotionSetpoint((1.0, -0.5, 0.0), STILL, yaw), STILL, STILL, 0.34, WIDE)
    lean = axis(answer)
    expected = 1.8 * 0.95 * np.array((1.0, -0.5))
    assert lean[:2] / lean[2] * 9.80665 == pytest.approx(expected)
    assert answer.thrust * lean[2] == pytest.approx(0.34)
    assert euler_from_quaternion(np.array(answer.attitude))[2] == pytest.approx(yaw)


def test_a_new_hover_thrust_is_no_bump() -> None:
    """The integral takes over what it changes: the thrust goes on as it was, also while the vehicle accelerates."""
    control = controller()
    for target in (0.0, 0.5):
        setpoint = MotionSetpoint((0.0, 0.0, target), STILL, 0.0)
        before = control.update(setpoint, STILL, STILL, 0.34, WIDE)
        after = control.update(setpoint, STILL, STILL, 0.40, WIDE)
        assert after.thrust == pytest.approx(before.thrust, abs=0.001)
        control.reset()


def test_tilt_is_limited() -> None:
    """A far target asks for no more than the tilt limit."""
    answer = controller().update(MotionSetpoint((50.0, 0.0, 0.0), STILL, 0.0), STILL, STILL, 0.34, math.radians(12.0))
    assert math.degrees(math.acos(axis(answer)[2])) == pytest.approx(12.0)


def test_height_comes_first_and_leaves_the_side_its_margin() -> None:
    """At full thrust the vertical gets what the horizontal's margin of 0.3 leaves."""
    answer = controller().update(MotionSetpoint((50.0, 0.0, 50.0), STILL, 0.0), STILL, STILL, 0.6, WIDE)
    assert answer.thrust == pytest.approx(1.0)
    assert answer.thrust * axis(answer)[0] == pytest.approx(0.3, abs=1e-6)


def test_the_integral_takes_over_a_steady_wind() -> None:
    """A velocity error that stays makes the lean grow; against the limit it does not wind up."""
    control = controller()
    setpoint = MotionSetpoint(STILL, STILL, 0.0)
    blown = (-0.5, 0.0, 0.0)
    first = axis(control.update(setpoint, STILL, blown, 0.34, WIDE))[0]
    for _ in range(250):
        last = axis(control.update(setpoint, STILL, blown, 0.34, WIDE))[0]
    assert last > first + 0.02
    for _ in range(20000):
        control.update(setpoint, STILL, blown, 0.34, math.radians(10.0))
    after = control.update(setpoint, STILL, STILL, 0.34, WIDE)
    assert axis(after)[0] < 0.35


def test_idle_means_no_thrust_and_an_empty_memory() -> None:
    """On the ground the answer is level without thrust, and integrals start anew."""
    control = controller()
    for _ in range(100):
        control.update(MotionSetpoint((1.0, 0.0, 1.0), STILL, 0.0), STILL, STILL, 0.34, WIDE)
    assert control.update(MotionSetpoint(STILL, STILL, 0.0, idle=True), STILL, STILL, 0.34, WIDE).thrust == 0.0
    answer = control.update(MotionSetpoint(STILL, STILL, 0.0), STILL, STILL, 0.34, WIDE)
    assert answer.thrust == pytest.approx(0.34)


def test_without_a_position_it_stays_level() -> None:
    """Descend ignores where the vehicle drifts and sinks at the speed asked for."""
    setpoint = MotionSetpoint((9.0, 9.0, 0.0), (0.0, 0.0, -0.7), 0.0, track_horizontal=False, track_height=False)
    answer = controller().update(setpoint, STILL, (3.0, 0.0, -0.7), 0.34, WIDE)
    assert axis(answer) == pytest.approx([0.0, 0.0, 1.0])
    assert answer.thrust == pytest.approx(0.34)


def test_the_take_off_ramp_begins_without_thrust() -> None:
    """The climb limit at which the ramp starts takes all of the hover thrust away."""
    setpoint = MotionSetpoint(STILL, (0.0, 0.0, 1.5), 0.0, track_height=False, climb_limit_m_s=-9.80665 / 4.0)
    assert controller().update(setpoint, STILL, STILL, 0.34, WIDE).thrust < 0.01


def test_hover_thrust_is_learned() -> None:
    """The estimate goes to the thrust that carries the weight, also while tilted and accelerating."""
    hover = HoverThrust(0.5)
    for _ in range(500):
        hover.learn(0.4, 0.9, 2.0, 0.04)
    assert hover.value == pytest.approx(0.4 * 0.9 * 9.80665 / 11.80665, rel=1e-3)
    hover.learn(0.02, 1.0, 0.0, 0.04)
    hover.learn(0.4, 1.0, -9.0, 0.04)
    assert hover.value == pytest.approx(0.299, abs=1e-3)


def test_a_senseless_gain_carries_the_integral_nowhere() -> None:
    """PX4 takes any finite parameter; an integral gain of the wrong sign and size must not end in infinity."""
    control = controller(MPC_XY_VEL_I_ACC=-1e6, MPC_XY_VEL_P_ACC=1e-6)
    for _ in range(2000):
        answer = control.update(MotionSetpoint((5.0, 3.0, 1.0), STILL, 0.0), STILL, (0.1, 0.0, 0.0), 0.34, WIDE)
        assert np.isfinite((*answer.attitude, answer.thrust)).all()


def test_a_speed_limit_below_zero_is_none() -> None:
    """At the target and at rest there is no speed to be divided by."""
    control = controller(MPC_XY_VEL_MAX=-1.0)
    answer = control.update(MotionSetpoint((1.0, 2.0, 3.0), STILL, 0.0), (1.0, 2.0, 3.0), STILL, 0.34, WIDE)
    assert answer.thrust == pytest.approx(0.34)


@pytest.mark.parametrize("hover", [0.0, -1.0, 1e-30])
def test_a_senseless_hover_thrust_divides_nothing(hover: float) -> None:
    """MPC_THR_HOVER may be set to anything."""
    control = controller()
    for _ in range(500):
        answer = control.update(MotionSetpoint((5.0, 3.0, 1.0), STILL, 0.0), STILL, STILL, hover, WIDE)
        assert np.isfinite((*answer.attitude, answer.thrust)).all()
