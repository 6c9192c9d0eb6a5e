"""What can be held: forces and references beyond it are shortened, all others are left alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.control.vehicle import f550
from uasfly.airframe import GRAVITY_M_S2
from uasfly.control.authority import FARTHEST_M, holdable_force, nearby

AIRFRAME = f550()
K_THRUST = AIRFRAME.model.k_thrust_m_s2


def _thrust_needed(force: np.ndarray) -> tuple[float, float]:
    """Tilt [rad] and thrust 0..1 that balance gravity and a force."""
    east, north, up = force.tolist()
    horizontal, vertical = math.hypot(east, north), GRAVITY_M_S2 - up
    return math.atan2(horizontal, vertical), math.hypot(horizontal, vertical) / K_THRUST


def test_a_force_that_can_be_held_is_left_alone() -> None:
    """The very same array comes back."""
    force = np.array([2.0, -1.5, -0.5])
    assert holdable_force(force, AIRFRAME.limits, K_THRUST) is force


@pytest.mark.parametrize("seed", range(20))
def test_what_comes_back_can_be_held(seed: int) -> None:
    """Tilt and thrust for the shortened force are inside the limits, however strong the force was."""
    force = np.random.default_rng(seed).normal(scale=15.0, size=3)
    tilt, thrust = _thrust_needed(holdable_force(force, AIRFRAME.limits, K_THRUST))
    assert tilt <= AIRFRAME.limits.tilt_rad
    assert AIRFRAME.limits.thrust_min <= thrust <= AIRFRAME.limits.thrust_max


def test_the_direction_on_the_map_stays() -> None:
    """A gust from one side is leaned against on that side."""
    held = holdable_force(np.array([12.0, -9.0, 0.0]), AIRFRAME.limits, K_THRUST)
    assert held[1] / held[0] == pytest.approx(-0.75)
    assert float(np.hypot(held[0], held[1])) < 15.0


def test_a_far_reference_is_moved_near_and_keeps_its_shape() -> None:
    """Only the offset changes; a near reference is left alone."""
    path = np.array([[10.0, 0.0, 1.0], [10.5, 0.2, 1.0], [11.0, 0.6, 1.1]])
    moved = nearby(path, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(moved[0], [FARTHEST_M, 0.0, 1.0])
    np.testing.assert_allclose(np.diff(moved, axis=0), np.diff(path, axis=0))
    assert nearby(path, np.array([9.0, 0.0, 1.0])) is path
