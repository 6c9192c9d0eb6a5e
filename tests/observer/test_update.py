from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from scipy.stats import chi2

from uasfly.messages import Array
from uasfly.observer import update as up
from uasfly.observer.states import MARKER_DOF, SENSOR_DOF


def run(build: Callable[..., ca.SX | tuple[ca.SX, ...]], *arguments: Array | float) -> list[Array]:
    """Numbers from a function that builds symbolic expressions."""
    matrices = [ca.DM(argument) for argument in arguments]
    symbols = [ca.SX.sym(f"a{k}", *matrix.shape) for k, matrix in enumerate(matrices)]
    result = build(*symbols)
    function = ca.Function("f", symbols, list(result) if isinstance(result, tuple) else [result])
    return [np.array(value.full()) for value in function.call(matrices)]


def positive_definite(n: int, rng: np.random.Generator) -> Array:
    """A well-mixed covariance (n, n)."""
    root = rng.standard_normal((n, n))
    return root @ root.T + 0.1 * np.eye(n)


def test_the_gates_are_the_chi_square_quantiles() -> None:
    """0.995 for three and for six degrees of freedom."""
    assert pytest.approx(chi2.ppf(0.995, SENSOR_DOF), rel=1e-12) == up.GATE_3
    assert pytest.approx(chi2.ppf(0.995, MARKER_DOF), rel=1e-12) == up.GATE_6


def test_the_inverse_of_a_symmetric_matrix_is_numpys() -> None:
    """By cofactors, also for axes of very different size."""
    scale = np.diag((1e-3, 1.0, 1e3))
    matrix = scale @ positive_definite(3, np.random.default_rng(0)) @ scale
    inverse = run(up.inverse_of_symmetric_3, matrix)[0]
    np.testing.assert_allclose(scale @ (inverse @ matrix) @ np.linalg.inv(scale), np.eye(3), atol=1e-10)


def test_the_joseph_update_is_the_textbooks_for_the_optimal_gain() -> None:
    """K = P H' S^-1 and P - K S K'."""
    rng = np.random.default_rng(1)
    P, H, R = positive_definite(7, rng), rng.standard_normal((3, 7)), positive_definite(3, rng)
    K, after = run(up.joseph_update, P, H, R, np.eye(7))
    S = H @ P @ H.T + R
    np.testing.assert_allclose(K, P @ H.T @ np.linalg.inv(S), atol=1e-10)
    np.testing.assert_allclose(after, P - K @ S @ K.T, atol=1e-10)


def test_the_joseph_update_stays_true_for_a_gain_that_is_not_optimal() -> None:
    """With rows of the gain moved and zeroed, the covariance is that of the error under this gain."""
    rng = np.random.default_rng(2)
    P, H, R = positive_definite(7, rng), rng.standard_normal((3, 7)), positive_definite(3, rng)
    allowed = np.eye(7)
    allowed[4:7, 4:7] = 0.0
    allowed[0:3, 4:7] = np.eye(3)
    K, after = run(up.joseph_update, P, H, R, allowed)
    assert np.all(K[4:7] == 0.0)
    left = np.eye(7) - K @ H
    np.testing.assert_allclose(after, left @ P @ left.T + K @ R @ K.T, atol=1e-9)
    assert np.array_equal(after, after.T)


def test_the_joseph_update_keeps_a_covariance_positive_definite_where_the_plain_one_fails() -> None:
    """Nine digits between P and R: P - K S K' loses its definiteness, the Joseph form does not."""
    rng = np.random.default_rng(3)
    P, H = 1e8 * positive_definite(6, rng), rng.standard_normal((3, 6))
    R = 1e-6 * np.eye(3)
    K, after = run(up.joseph_update, P, H, R, np.eye(6))
    plain = P - K @ (H @ P @ H.T + R) @ K.T
    measured = np.linalg.eigvalsh(H @ after @ H.T).min()
    assert measured > 0.0
    assert np.linalg.eigvalsh(0.5 * (plain + plain.T)).min() < 0.0


def test_a_refused_measurement_leaves_the_covariance_bit_for_bit() -> None:
    """Zero in place of the gain's matrix."""
    rng = np.random.default_rng(4)
    P = positive_definite(5, rng)
    K, after = run(up.joseph_update, P, rng.standard_normal((3, 5)), np.eye(3), np.zeros((5, 5)))
    assert not K.any()
    assert np.array_equal(np.triu(after), np.triu(P))


@pytest.mark.parametrize("seed", range(20))
def test_bounded_noise_is_positive_definite_and_within_its_bounds(seed: int) -> None:
    """Whatever the matching has come to, indefinite matrices included."""
    rng = np.random.default_rng(seed)
    matched = rng.standard_normal((3, 3)) * 10.0 ** rng.uniform(-9, 9)
    R = run(up.bounded, matched + matched.T, 0.01)[0]
    assert np.array_equal(R, R.T)
    assert np.linalg.eigvalsh(R).min() > 0.0
    sigmas = np.sqrt(np.diag(R) / 0.01)
    assert np.all(sigmas >= up.SIGMA_FACTOR_MIN * (1 - 1e-9))
    assert np.all(sigmas <= up.SIGMA_FACTOR_MAX * (1 + 1e-9))


def test_noise_within_the_bounds_is_used_as_matched() -> None:
    """Mild correlations and sizes pass unchanged."""
    matched = np.array(((0.02, 0.004, 0.0), (0.004, 0.01, -0.003), (0.0, -0.003, 0.03)))
    np.testing.assert_allclose(run(up.bounded, matched, 0.01)[0], matched)


@pytest.mark.parametrize("true_scale", [0.5, 1.0, 4.0])
def test_covariance_matching_finds_the_noise_of_a_sensor(true_scale: float) -> None:
    """Innovations of covariance H P H' + R drive the matched covariance to R (eq. 8, 9), from a wrong start."""
    rng = np.random.default_rng(5)
    expected = 0.2 * np.array(((1.0, 0.2, 0.0), (0.2, 2.0, 0.1), (0.0, 0.1, 0.5)))
    R = true_scale * np.array(((1.0, 0.3, 0.0), (0.3, 1.0, -0.2), (0.0, -0.2, 1.0)))
    matched = np.eye(3)
    names = [ca.SX.sym("m", 3, 3), ca.SX.sym("r", 3)]
    inverse = up.inverse_of_symmetric_3(ca.DM(expected) + names[0])
    step = ca.Function("f", names, [up.matched_covariance(names[0], names[0], inverse, names[1], ca.SX(0.004))])
    for innovation in rng.multivariate_normal(np.zeros(3), expected + R, 5000):
        matched = np.array(step(matched, innovation).full())
    np.testing.assert_allclose(matched, R, atol=0.25 * true_scale)


def test_covariance_matching_never_leaves_the_positive_definite() -> None:
    """With an uncertainty far above the noise, where mean(r r') - H P H' is negative, the matched covariance holds."""
    rng = np.random.default_rng(6)
    expected, matched = 100.0 * np.eye(3), 0.01 * np.eye(3)
    for _ in range(50):
        inverse = np.asarray(np.linalg.inv(expected + matched), dtype=float)
        innovation = 0.1 * rng.standard_normal(3)  # far smaller than expected
        matched = run(up.matched_covariance, matched, matched, inverse, innovation, 0.1)[0]
        assert np.linalg.eigvalsh(matched).min() > 0.0
    np.testing.assert_allclose(np.diag(matched), 0.01, rtol=0.05)  # such innovations say nothing of R


def test_the_innovation_test_accepts_inside_the_gate_only() -> None:
    """Just inside, just outside, and a sensor that says nothing."""
    edge = np.array((np.sqrt(up.GATE_3), 0.0, 0.0))
    for factor, use, expected in ((0.999, 1.0, 1.0), (1.001, 1.0, 0.0), (0.999, 0.0, 0.0)):
        _, accepted, _ = run(up.innovation_test, factor * edge, 0.4 * np.eye(3), 0.6 * np.eye(3), use)
        assert accepted[0, 0] == expected
