from __future__ import annotations

import numpy as np
import pytest

from tests.observer.manifold import (
    difference_quotient,
    evaluated,
    minus_pose,
    plus_core,
    plus_pose,
    random_core,
    random_pose,
)
from tests.observer.truth import turn_between
from uasfly.frames import quaternion_from_rotation_vector, quaternion_inverse, quaternion_product, rotation_matrix
from uasfly.messages import Array
from uasfly.observer import measurements as me
from uasfly.observer import states as s

SEEDS = range(3)


def attitude_as_told(core: Array) -> Array:
    """Attitude (4,) with its slow error."""
    return quaternion_product(core[s.QUATERNION], quaternion_from_rotation_vector(core[s.ATTITUDE_WANDER]))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("sensor", range(3))
def test_odometry_jacobians_are_the_derivatives_of_the_measurements(seed: int, sensor: int) -> None:
    """Attitude and velocity (with wander), position (with bias): H agrees with finite differences on the manifold."""
    core = random_core(np.random.default_rng(seed))

    def measured(error: Array) -> Array:
        moved = plus_core(core, error)
        if sensor == s.ATTITUDE_SENSOR:
            return turn_between(attitude_as_told(core), attitude_as_told(moved))
        if sensor == s.POSITION_SENSOR:
            return np.asarray(moved[s.POSITION] + moved[s.BIAS])
        return np.asarray(moved[s.VELOCITY] + moved[s.VELOCITY_WANDER])

    jacobian = evaluated(lambda x: me.odometry_jacobian(x, sensor), core)[0]
    np.testing.assert_allclose(jacobian, difference_quotient(measured, s.CORE_ERROR), atol=1e-9)


def test_an_attitude_innovation_is_the_body_side_turn_to_the_measurement() -> None:
    """The expected attitude * exp(innovation) is the measured one, also for the other sign of the quaternion."""
    rng = np.random.default_rng(1)
    core, turn = random_core(rng), np.array((0.3, -0.5, 1.0))
    measured = quaternion_product(attitude_as_told(core), quaternion_from_rotation_vector(turn))
    np.testing.assert_allclose(evaluated(me.attitude_innovation, core, measured)[0], turn, atol=1e-12)
    np.testing.assert_allclose(evaluated(me.attitude_innovation, core, -measured)[0], turn, atol=1e-12)


def test_a_marker_is_seen_from_the_body_as_equation_7_says() -> None:
    """R'(p_M - p) and q^-1 q_M."""
    rng = np.random.default_rng(2)
    core, marker = random_core(rng), random_pose(rng)
    seen = evaluated(me.measure_marker, core, marker)[0]
    rotation = rotation_matrix(core[s.QUATERNION])
    np.testing.assert_allclose(seen[:3], rotation.T @ (marker[:3] - core[s.POSITION]), atol=1e-12)
    expected = quaternion_product(quaternion_inverse(core[s.QUATERNION]), marker[3:])
    np.testing.assert_allclose(seen[3:], expected, atol=1e-12)


def test_locating_a_marker_turns_the_sighting_round() -> None:
    """A marker located from its own sighting lies where it was, and leaves no innovation."""
    rng = np.random.default_rng(3)
    core, marker = random_core(rng), random_pose(rng)
    seen = evaluated(me.measure_marker, core, marker)[0]
    np.testing.assert_allclose(evaluated(me.locate_marker, core, seen)[0], marker, atol=1e-12)
    np.testing.assert_allclose(evaluated(me.marker_innovation, core, marker, seen)[0], np.zeros(6), atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_marker_jacobians_are_the_derivatives_of_equation_7(seed: int) -> None:
    """By the core's error and by the marker's own, along the manifold."""
    rng = np.random.default_rng(seed)
    core, marker = random_core(rng), random_pose(rng)
    seen = evaluated(me.measure_marker, core, marker)[0]
    by_core, by_marker = evaluated(me.marker_jacobians, core, marker)

    def moved_core(error: Array) -> Array:
        return minus_pose(seen, evaluated(me.measure_marker, plus_core(core, error), marker)[0])

    def moved_marker(error: Array) -> Array:
        return minus_pose(seen, evaluated(me.measure_marker, core, plus_pose(marker, error))[0])

    np.testing.assert_allclose(by_core, difference_quotient(moved_core, s.CORE_ERROR), atol=1e-8)
    np.testing.assert_allclose(by_marker, difference_quotient(moved_marker, s.MARKER_ERROR), atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_locating_jacobians_are_the_derivatives_of_the_first_sight(seed: int) -> None:
    """By the core's error and by the sighting's noise, along the manifold."""
    rng = np.random.default_rng(seed)
    core, seen = random_core(rng), random_pose(rng)
    located = evaluated(me.locate_marker, core, seen)[0]
    by_core, by_noise = evaluated(me.locating_jacobians, core, seen)

    def moved_core(error: Array) -> Array:
        return minus_pose(located, evaluated(me.locate_marker, plus_core(core, error), seen)[0])

    def moved_sighting(noise: Array) -> Array:
        return minus_pose(located, evaluated(me.locate_marker, core, plus_pose(seen, noise))[0])

    np.testing.assert_allclose(by_core, difference_quotient(moved_core, s.CORE_ERROR), atol=1e-8)
    np.testing.assert_allclose(by_noise, difference_quotient(moved_sighting, s.MARKER_ERROR), atol=1e-8)
