from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from tests.sim.plants import PLANTS, number, plant
from uasfly.messages import Array
from uasfly.sim.mixer import mix_commands, mixing_matrix


def mixed(name: str, roll: float, pitch: float, yaw: float, thrust: float) -> tuple[Array, Array]:
    """Motor commands and the share of the torques that they keep."""
    symbol = ca.SX.sym("c", 4)
    mix = mix_commands(ca.SX(mixing_matrix(plant(name).rotors)), symbol[:3], symbol[3])
    value = number(ca.vertcat(mix.motors, mix.kept), symbol, [roll, pitch, yaw, thrust])
    return value[:-3], value[-3:]


def torques(name: str, motors: Array) -> Array:
    """Roll, pitch and yaw torque and thrust of motor commands, in units of full thrust, arm and drag."""
    rotors = plant(name).rotors
    xs, ys = np.array(rotors.positions_m).T / rotors.arm_length_m
    return np.array((ys @ motors, -xs @ motors, -np.array(rotors.spins) @ motors, motors.sum()))


@pytest.mark.parametrize("name", PLANTS)
def test_thrust_alone_is_shared_equally(name: str) -> None:
    """Without torques every motor gives the thrust command."""
    motors, kept = mixed(name, 0.0, 0.0, 0.0, 0.4)
    assert motors == pytest.approx(np.full(len(motors), 0.4))
    assert kept.tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_torque_command_makes_that_torque_alone(name: str, axis: int) -> None:
    """A small command on one axis makes positive torque about it, none about the others, and no thrust."""
    roll, pitch, yaw = (0.05 if index == axis else 0.0 for index in range(3))
    motors, _ = mixed(name, roll, pitch, yaw, 0.5)
    made = torques(name, motors)
    assert made[axis] > 0.05
    assert np.delete(made[:3], axis) == pytest.approx(np.zeros(2), abs=1e-9)
    assert made[3] == pytest.approx(0.5 * len(motors))


def test_quadrotor_mix_is_normalised_as_in_px4() -> None:
    """PX4 mixes roll and pitch of a quadrotor x with 0.707 a motor and yaw with 1."""
    matrix = mixing_matrix(plant("px4_sih").rotors)
    assert np.abs(matrix[:, :2]) == pytest.approx(np.full((4, 2), np.sqrt(0.5)))
    assert np.abs(matrix[:, 2:]) == pytest.approx(np.ones((4, 2)))


@pytest.mark.parametrize("name", ["f550", "iris"])
def test_yaw_gives_way_first(name: str) -> None:
    """When a motor would saturate, roll, pitch and thrust stay and yaw shrinks."""
    motors, kept = mixed(name, 0.2, 0.1, 0.9, 0.5)
    made, calm = torques(name, motors), torques(name, mixed(name, 0.2, 0.1, 0.0, 0.5)[0])
    assert kept[0] == 1.0
    assert 0.0 < kept[2] < 1.0
    assert made[[0, 1, 3]] == pytest.approx(calm[[0, 1, 3]])
    assert motors.min() >= 0.0
    assert motors.max() <= 1.0


def test_at_full_thrust_the_thrust_gives_way_to_roll() -> None:
    """A roll command at full thrust is kept whole; the thrust drops."""
    motors, kept = mixed("f550", 0.2, 0.0, 0.0, 1.0)
    calm, _ = mixed("f550", 0.2, 0.0, 0.0, 0.5)
    assert kept[0] == 1.0
    assert torques("f550", motors)[0] == pytest.approx(torques("f550", calm)[0])
    assert motors.max() == pytest.approx(1.0)
    assert motors.mean() < 0.95


def test_without_thrust_roll_and_pitch_shrink_together() -> None:
    """Torques never raise the thrust (PX4's airmode off): at low thrust they keep direction but not size."""
    motors, kept = mixed("f550", 0.3, 0.2, 0.0, 0.05)
    calm = torques("f550", mixed("f550", 0.3, 0.2, 0.0, 0.5)[0])
    made = torques("f550", motors)
    assert motors.mean() == pytest.approx(0.05)
    assert made[0] / made[1] == pytest.approx(calm[0] / calm[1])
    assert kept[0] == kept[1] == pytest.approx(made[0] / calm[0])
    assert kept[0] < 0.5


def test_every_command_stays_in_range() -> None:
    """Whatever is asked, motors stay within 0..1."""
    rng = np.random.default_rng(3)
    symbol = ca.SX.sym("c", 4)
    mix = mix_commands(ca.SX(mixing_matrix(plant("f550").rotors)), symbol[:3], symbol[3])
    function = ca.Function("f", [symbol], [mix.motors, mix.kept])
    for _ in range(500):
        motors, kept = (np.array(v) for v in function([*rng.normal(0.0, 1.0, 3), rng.uniform()]))
        assert motors.min() >= 0.0
        assert motors.max() <= 1.0
        assert kept.min() >= 0.0
        assert kept.max() <= 1.0
