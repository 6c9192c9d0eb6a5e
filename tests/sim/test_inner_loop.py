from __future__ import annotations

import math
from array import array

import pytest

from tests.sim.plants import PLANTS, hover_speed, hovering, plant, roll_pitch
from uasfly.frames import quaternion_from_euler
from uasfly.sim.dynamics import STEP_S, PlantDynamics
from uasfly.sim.inner_loop import (
    ARMED,
    FLYING,
    FULL_SPEED,
    INTEGRAL,
    SETPOINT_ATTITUDE,
    SETPOINT_THRUST,
    SETPOINT_YAW_RATE,
    InnerLoop,
)
from uasfly.sim.parameters import ParameterTable


def closed_loop(name: str) -> tuple[PlantDynamics, InnerLoop, ParameterTable]:
    """A hovering plant under its own attitude control, level."""
    figures = plant(name)
    dynamics, parameters = hovering(figures), ParameterTable(figures.parameters)
    loop = InnerLoop(figures.rotors, parameters, dynamics.state, dynamics.targets, STEP_S)
    loop.inputs[FULL_SPEED] = figures.rotors.full_speed_rad_s
    loop.inputs[SETPOINT_THRUST] = (
        hover_speed(figures) / figures.rotors.full_speed_rad_s
    ) ** figures.rotors.speed_exponent
    loop.inputs[ARMED] = loop.inputs[FLYING] = 1.0
    point(loop, 0.0, 0.0, 0.0)
    return dynamics, loop, parameters


def point(loop: InnerLoop, roll: float, pitch: float, yaw: float) -> None:
    """Set the attitude setpoint [rad]."""
    loop.inputs[SETPOINT_ATTITUDE] = array("d", quaternion_from_euler(roll, pitch, yaw))


def run(dynamics: PlantDynamics, loop: InnerLoop, seconds: float) -> None:
    """Let time pass."""
    for _ in range(round(seconds / STEP_S)):
        loop.step()
        dynamics.step()


@pytest.mark.parametrize("name", PLANTS)
def test_hover_thrust_holds_the_height(name: str) -> None:
    """Thrust g / k_thrust through mixer and thrust curve carries the weight."""
    dynamics, loop, _ = closed_loop(name)
    run(dynamics, loop, 1.0)
    assert dynamics.state[5] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", PLANTS)
def test_the_vehicle_turns_to_its_setpoint(name: str) -> None:
    """Roll, pitch and yaw arrive at what was asked, with the signs of FLU, overshooting by less than a tenth."""
    dynamics, loop, _ = closed_loop(name)
    point(loop, 0.2, -0.1, 0.4)
    highest = 0.0
    for _ in range(10):
        run(dynamics, loop, 0.3)
        highest = max(highest, roll_pitch(dynamics.state[6:10])[0])
    roll, pitch = roll_pitch(dynamics.state[6:10])
    w, x, y, z = dynamics.state[6:10]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    assert roll == pytest.approx(0.2, abs=0.01)
    assert pitch == pytest.approx(-0.1, abs=0.01)
    assert yaw == pytest.approx(0.4, abs=0.03)
    assert highest < 0.22
    assert dynamics.state[4] < -0.5  # a vehicle rolled to the right flies to the right


def test_a_yaw_ramp_is_followed_with_feed_forward_and_lags_without() -> None:
    """REFERENCE section 3: a ramp of 0.5 rad/s lags 0.3 degrees with the feed-forward, 11.8 degrees without."""
    lags = {}
    for feed_forward in (0.0, 0.5):
        dynamics, loop, _ = closed_loop("px4_sih")
        loop.inputs[SETPOINT_YAW_RATE] = feed_forward
        for step in range(150):
            point(loop, 0.0, 0.0, 0.5 * 0.02 * (step + 1))
            run(dynamics, loop, 0.02)
        w, _, _, z = dynamics.state[6:10]
        lags[feed_forward] = math.degrees(0.5 * 3.0 - 2.0 * math.atan2(z, w))
    assert abs(lags[0.5]) < 1.0
    assert lags[0.0] == pytest.approx(11.8, abs=1.0)


def test_disarmed_motors_stand_still_and_nothing_winds_up() -> None:
    """Disarmed, every target is 0; on the ground the integrals rest."""
    dynamics, loop, _ = closed_loop("f550")
    point(loop, 0.3, 0.0, 0.0)
    loop.inputs[FLYING] = 0.0
    run(dynamics, loop, 0.1)
    assert max(dynamics.targets) > 0.0
    assert not any(loop.memory[INTEGRAL])
    loop.inputs[ARMED] = 0.0
    loop.step()
    assert not any(dynamics.targets)


def test_an_integral_takes_over_a_lasting_torque() -> None:
    """A weak motor is balanced by the integral part: the vehicle returns to level."""
    dynamics, loop, _ = closed_loop("f550")
    dynamics.effectiveness[0] = 0.9
    run(dynamics, loop, 4.0)
    roll, pitch = roll_pitch(dynamics.state[6:10])
    assert abs(roll) < 0.01
    assert abs(pitch) < 0.01
    assert max(abs(value) for value in loop.memory[INTEGRAL]) > 0.005


def test_changed_gains_act_when_they_are_read() -> None:
    """A parameter takes effect with `read_parameters`."""
    rolls = []
    for gain in (3.0, 8.0):
        dynamics, loop, parameters = closed_loop("f550")
        parameters.set("MC_ROLL_P", gain)
        loop.read_parameters()
        point(loop, 0.2, 0.0, 0.0)
        run(dynamics, loop, 0.15)
        rolls.append(roll_pitch(dynamics.state[6:10])[0])
    assert rolls[1] > 1.5 * rolls[0]


def test_reset_starts_the_reference_at_an_attitude() -> None:
    """After a reset the reference is where it was put and the integrals are empty."""
    dynamics, loop, _ = closed_loop("f550")
    point(loop, 0.2, 0.0, 0.0)
    run(dynamics, loop, 0.5)
    loop.reset((math.cos(0.4), 0.0, 0.0, math.sin(0.4)))
    assert list(loop.memory[0:4]) == [math.cos(0.4), 0.0, 0.0, math.sin(0.4)]
    assert not any(loop.memory[INTEGRAL])
