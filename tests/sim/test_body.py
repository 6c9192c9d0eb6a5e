from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from tests.sim.plants import number, plant
from uasfly.frames import rotation_matrix
from uasfly.sim.body import ANGULAR_RATE, ATTITUDE, VELOCITY, body_derivative, rotation_body_to_world
from uasfly.sim.dynamics import PlantDynamics, runge_kutta_step


def test_rotation_agrees_with_the_frames() -> None:
    """The symbolic rotation is the one of uasfly.frames."""
    quaternion = np.array((0.5, -0.1, 0.7, 0.4))
    quaternion /= np.linalg.norm(quaternion)
    symbol = ca.SX.sym("q", 4)
    assert number(rotation_body_to_world(symbol), symbol, quaternion) == pytest.approx(rotation_matrix(quaternion))


def test_free_fall() -> None:
    """Without air and thrust a body falls by g t^2 / 2."""
    figures = plant("px4_sih", {"drag.linear_n_s_m": [0.0, 0.0, 0.0]})
    dynamics = PlantDynamics(figures)
    dynamics.place((1.0, 2.0, 100.0), 1.0, 0.0)
    for _ in range(500):
        dynamics.step()
    assert dynamics.state[0:3].tolist() == pytest.approx([1.0, 2.0, 100.0 - 0.5 * 9.80665 * 4.0], abs=1e-9)
    assert dynamics.state[5] == pytest.approx(-9.80665 * 2.0, abs=1e-9)


def test_tumbling_keeps_energy_and_angular_momentum() -> None:
    """A body that tumbles about its middle axis keeps its energy and its angular momentum in the world."""
    inertia = (0.02, 0.03, 0.045)
    state = ca.SX.sym("x", 13)
    stepped, _ = runge_kutta_step(
        lambda x: body_derivative(x, ca.SX.zeros(3), ca.SX.zeros(3), 1.0, inertia), state, 0.004
    )
    step = ca.Function("step", [state], [stepped])
    now = np.zeros(13)
    now[ATTITUDE] = (1.0, 0.0, 0.0, 0.0)
    now[ANGULAR_RATE] = (0.05, 6.0, 0.05)

    def energy_and_momentum(x: np.ndarray) -> tuple[float, np.ndarray]:
        momentum = np.array(inertia) * x[ANGULAR_RATE]
        return 0.5 * float(momentum @ x[ANGULAR_RATE]), rotation_matrix(x[ATTITUDE]) @ momentum

    energy, momentum = energy_and_momentum(now)
    for _ in range(1000):
        now = np.array(step(now)).squeeze()
    later_energy, later_momentum = energy_and_momentum(now)
    assert abs(now[ANGULAR_RATE][1] - 6.0) > 0.5  # it has tumbled
    assert later_energy == pytest.approx(energy, rel=1e-6)
    assert later_momentum == pytest.approx(momentum, rel=1e-5, abs=1e-6)
    assert now[VELOCITY][2] == pytest.approx(-9.80665 * 4.0)
