from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from tests.observer.manifold import (
    difference_quotient,
    evaluated,
    flying_inputs,
    minus_core,
    plus_core,
    random_core,
)
from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import quaternion_from_rotation_vector, quaternion_product, rotation_vector_from_quaternion
from uasfly.messages import Array
from uasfly.observer import error_state as es
from uasfly.observer import states as s
from uasfly.observer.step import MAX_STEP_S

SEEDS = range(4)


def equation_1(core: Array, inputs: Array) -> Array:
    """Eq. 1 written out with scipy's rotations: derivative (22,) of the core state."""
    w, x, y, z = core[s.QUATERNION]
    direction = Rotation.from_quat((x, y, z, w)).apply((0.0, 0.0, 1.0))
    acceleration = direction * inputs[s.IN_THRUST] - (0.0, 0.0, GRAVITY_M_S2) + core[s.FORCE]
    acceleration = acceleration - inputs[s.IN_DRAG] * core[s.VELOCITY]
    rate = 0.5 * quaternion_product(core[s.QUATERNION], np.concatenate(((0.0,), inputs[s.IN_RATE])))
    wander_rate = -inputs[s.IN_WANDER_RATE] * core[s.VELOCITY_WANDER.start : s.ATTITUDE_WANDER.stop]
    return np.concatenate((core[s.VELOCITY], acceleration, rate, np.zeros(6), wander_rate))


def van_loan(A: Array, Q: Array, dt: float) -> Array:
    """Discrete noise covariance by Van Loan's matrix exponential."""
    n = len(A)
    block = expm(np.block([[-A, Q], [np.zeros((n, n)), A.T]]) * dt)
    return np.asarray(block[n:, n:].T @ block[:n, n:])


def densities(inputs: Array) -> Array:
    """Continuous noise densities (21, 21)."""
    parts = (
        0.0,
        inputs[s.IN_ACCELERATION_DENSITY],
        inputs[s.IN_ATTITUDE_DENSITY],
        inputs[s.IN_FORCE_DENSITY],
        inputs[s.IN_BIAS_DENSITY],
        inputs[s.IN_VELOCITY_WANDER_DENSITY],
        inputs[s.IN_ATTITUDE_WANDER_DENSITY],
    )
    return np.diag(np.concatenate([np.broadcast_to(part, 3) for part in parts]))


@pytest.mark.parametrize("angle_rad", [0.0, 1e-9, 1e-3, 0.3, 1.0])
def test_exponential_is_the_quaternion_of_a_rotation_vector(angle_rad: float) -> None:
    """The series agrees with the closed form up to one radian."""
    vector = angle_rad * np.array((0.6, -0.64, 0.48))
    np.testing.assert_allclose(
        evaluated(es.exponential, vector)[0], quaternion_from_rotation_vector(vector), atol=1e-14
    )


@pytest.mark.parametrize("angle_rad", [0.0, 1e-9, 0.3, 3.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_logarithm_finds_the_shortest_turn_of_either_sign(angle_rad: float, sign: float) -> None:
    """Both q and -q give the same rotation vector, whatever its size."""
    vector = angle_rad * np.array((0.6, -0.64, 0.48))
    quaternion = sign * quaternion_from_rotation_vector(vector)
    np.testing.assert_allclose(evaluated(es.logarithm, quaternion)[0], vector, atol=1e-12)


def test_prediction_integrates_equation_1() -> None:
    """Position, velocity and attitude after 40 ms of a brisk turn agree with an adaptive integrator."""
    rng = np.random.default_rng(2)
    core, inputs = random_core(rng), flying_inputs(rng, 0.04)
    exact = solve_ivp(lambda _, x: equation_1(x, inputs), (0.0, 0.04), core, rtol=1e-12, atol=1e-12).y[:, -1]
    predicted = evaluated(es.predict_nominal, core, inputs)[0]
    np.testing.assert_allclose(predicted, exact, atol=1e-8)


def test_prediction_on_the_ground_keeps_the_velocity() -> None:
    """With the airborne flag down, neither gravity nor thrust nor force moves the vehicle."""
    rng = np.random.default_rng(2)
    core, inputs = random_core(rng), flying_inputs(rng, 0.02)
    inputs[s.IN_AIRBORNE] = 0.0
    predicted = evaluated(es.predict_nominal, core, inputs)[0]
    np.testing.assert_allclose(predicted[s.VELOCITY], core[s.VELOCITY])
    np.testing.assert_allclose(predicted[s.POSITION], core[s.POSITION] + 0.02 * core[s.VELOCITY])


@pytest.mark.parametrize("seed", SEEDS)
def test_transition_is_the_derivative_of_the_prediction(seed: int) -> None:
    """Phi agrees with finite differences of the predicted state along the manifold."""
    rng = np.random.default_rng(seed)
    core, inputs = random_core(rng), flying_inputs(rng, 0.04)
    moved = evaluated(es.predict_nominal, core, inputs)[0]

    def after(error: Array) -> Array:
        return minus_core(moved, evaluated(es.predict_nominal, plus_core(core, error), inputs)[0])

    numeric = difference_quotient(after, s.CORE_ERROR)
    np.testing.assert_allclose(evaluated(es.transition, core, inputs)[0], numeric, atol=2e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_error_dynamics_are_the_derivative_of_the_error_rate(seed: int) -> None:
    """A agrees with the rate at which two nearby solutions of eq. 1 part."""
    rng = np.random.default_rng(seed)
    core, inputs = random_core(rng), flying_inputs(rng, 0.0)
    h = 1e-4

    def flown(start: Array, time_s: float) -> Array:
        steps = inputs.copy()
        steps[s.IN_DT] = time_s
        return evaluated(es.predict_nominal, start, steps)[0]

    def parting_rate(error: Array) -> Array:
        other = plus_core(core, error)
        later = minus_core(flown(core, h), flown(other, h))
        earlier = minus_core(flown(core, -h), flown(other, -h))
        return (later - earlier) / (2.0 * h)

    numeric = difference_quotient(parting_rate, s.CORE_ERROR, step=1e-3)
    np.testing.assert_allclose(evaluated(es.error_dynamics, core, inputs)[0], numeric, atol=2e-5)


def test_transition_is_the_matrix_exponential_without_a_turn() -> None:
    """With constant attitude the error dynamics are constant and Phi is exp(A dt)."""
    rng = np.random.default_rng(5)
    core, inputs = random_core(rng), flying_inputs(rng, 0.04)
    inputs[s.IN_RATE] = 0.0
    A = evaluated(es.error_dynamics, core, inputs)[0]
    np.testing.assert_allclose(evaluated(es.transition, core, inputs)[0], expm(A * 0.04), atol=1e-9)


def test_transition_is_the_product_of_matrix_exponentials_in_a_turn() -> None:
    """With the attitude turning, Phi is the ordered product of exp(A dt) over short pieces."""
    rng = np.random.default_rng(6)
    core, inputs = random_core(rng), flying_inputs(rng, 0.04)
    product, pieces = np.eye(s.CORE_ERROR), 200
    piece = inputs.copy()
    for k in range(pieces):
        piece[s.IN_DT] = 0.04 * (k + 0.5) / pieces
        middle = evaluated(es.predict_nominal, core, piece)[0]
        product = expm(evaluated(es.error_dynamics, middle, inputs)[0] * 0.04 / pieces) @ product
    np.testing.assert_allclose(evaluated(es.transition, core, inputs)[0], product, atol=1e-6)


def noise_error(dt_s: float) -> float:
    """Largest difference to Van Loan's covariance, in units of each pair of sigmas, in a turn of some rad/s."""
    rng = np.random.default_rng(1)
    core, inputs = random_core(rng), flying_inputs(rng, dt_s)
    exact = van_loan(evaluated(es.error_dynamics, core, inputs)[0], densities(inputs), dt_s)
    sigmas = np.sqrt(np.diag(exact))
    difference = evaluated(es.noise_covariance, core, inputs)[0] - exact
    return float(np.abs(difference / np.outer(sigmas, sigmas)).max())


def test_noise_covariance_is_van_loans() -> None:
    """The series gives what the matrix exponential gives: to 1e-6 of the sigmas at 100 Hz, 1e-4 in the longest step."""
    assert noise_error(0.01) < 1e-6
    assert noise_error(MAX_STEP_S) < 1e-4


def test_noise_covariance_converges_with_the_order_of_its_series() -> None:
    """Five terms of dt: halving the step takes the error of the position's dt^3 down by at least 2^3."""
    assert noise_error(0.02) < noise_error(0.04) / 8.0


def test_noise_covariance_adds_up_over_the_steps() -> None:
    """Two steps of 10 ms leave the same covariance as one of 20 ms: nothing depends on the rate."""
    rng = np.random.default_rng(8)
    core, inputs = random_core(rng), flying_inputs(rng, 0.02)
    inputs[s.IN_RATE] = 0.0
    whole = evaluated(es.noise_covariance, core, inputs)[0]
    inputs[s.IN_DT] = 0.01
    half, phi = evaluated(es.noise_covariance, core, inputs)[0], evaluated(es.transition, core, inputs)[0]
    sigmas = np.sqrt(np.diag(whole))
    assert np.abs((phi @ half @ phi.T + half - whole) / np.outer(sigmas, sigmas)).max() < 1e-5


@pytest.mark.parametrize("angle_rad", [0.0, 0.05, 0.6])
def test_reset_jacobian_is_the_derivative_of_the_error_that_is_left(angle_rad: float) -> None:
    """After q is corrected by d, an error e has become log(exp(-d) exp(e)); its derivative at e = d is the Jacobian."""
    correction = angle_rad * np.array((0.6, -0.64, 0.48))

    def left(step: Array) -> Array:
        back = quaternion_from_rotation_vector(-correction)
        return rotation_vector_from_quaternion(
            quaternion_product(back, quaternion_from_rotation_vector(correction + step))
        )

    numeric = difference_quotient(left, 3)
    np.testing.assert_allclose(evaluated(es.reset_jacobian, correction)[0], numeric, atol=1e-9)


def test_retracting_adds_along_the_manifold_for_markers_too() -> None:
    """The nominal state with an error added agrees with adding part by part."""
    rng = np.random.default_rng(9)
    core, error = random_core(rng), 0.1 * rng.standard_normal(s.CORE_ERROR)
    np.testing.assert_allclose(evaluated(es.retract, core, error)[0], plus_core(core, error), atol=1e-12)
