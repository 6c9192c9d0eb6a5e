"""Symbolic algebra of one gated measurement update: gain, Joseph form, gate, covariance matching (eq. 8, 9).

Kalaitzakis & Vitzilaios 2023, section 2.3. Covariances are kept symmetric by building one triangle and mirroring it.

Covariance matching. Eq. 8 and 9 estimate R as mean(r r') - H P H', which is indefinite whenever P is large or the
window short. Here the same correction is weighted with W = R S^-1 on both sides, S = H P H' + R:

    R_new = W r r' W' + R - W R          (the weighted form of R + (r r' - S))

which is positive definite by construction (W r is the innovation after the update, R - W R = H P_after H'), agrees
with eq. 9 where R dominates S, and learns nothing where P does. The mean over the window is exponential with half the
window as time constant (same mean age and same variance as a box), so that it needs no memory and can be put back in
time. An innovation outside its gate enters shortened to the gate: one spike of any size raises R by a tenth, while a
jump that stays raises it geometrically until it is let in.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca

from uasfly.observer.matrices import Matrix, by_numbers

# chi-square, 0.995 quantile
GATE_3 = 12.838156466598651
GATE_6 = 18.547584178511086

# Matched sigmas stay within these multiples of the configured ones. Low: PX4's output is smoothed, its innovations show
# only the fast part of its error; below a third the matching would trade the hidden slow part for gain. High: only a
# guard against overflow, because a bound that a jump can exceed would shut the sensor out for ever.
SIGMA_FACTOR_MIN = 0.3
SIGMA_FACTOR_MAX = 1e4
# Matched correlations between axes are mostly chance; below 0.5 three of them always leave R positive definite.
CORRELATION_MAX = 0.49


def symmetric(matrix: Matrix) -> Matrix:
    """The upper triangle of a square matrix, mirrored."""
    return ca.triu2symm(ca.triu(matrix))


def inverse_of_symmetric_3(matrix: Matrix) -> Matrix:
    """Inverse (3, 3) of a symmetric positive definite (3, 3)."""
    if isinstance(matrix, ca.MX):
        return _inverse()(matrix)
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 1], matrix[1, 2], matrix[2, 2]
    c00, c01, c02 = d * f - e * e, c * e - b * f, b * e - c * d
    c11, c12, c22 = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * c00 + b * c01 + c * c02
    rows = ((c00, c01, c02), (c01, c11, c12), (c02, c12, c22))
    return ca.vertcat(*(ca.horzcat(*row) for row in rows)) / determinant


@lru_cache(maxsize=1)
def _inverse() -> ca.Function:
    return by_numbers("inverse", lambda numbers: [inverse_of_symmetric_3(numbers)], (3, 3))


def bounded(matched: ca.SX, variance: ca.SX) -> ca.SX:
    """Measurement covariance (3, 3) to use: the matched one within the bounds of this module around `variance`."""
    low, high = SIGMA_FACTOR_MIN**2 * variance, SIGMA_FACTOR_MAX**2 * variance
    diagonal = [ca.fmin(ca.fmax(matched[i, i], low), high) for i in range(3)]
    result = ca.SX(ca.diag(ca.vertcat(*diagonal)))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        limit = CORRELATION_MAX * ca.sqrt(diagonal[i] * diagonal[j])
        result[i, j] = result[j, i] = ca.fmin(ca.fmax(matched[i, j], -limit), limit)
    return result


def innovation_test(residual: ca.SX, expected: ca.SX, noise: ca.SX, use: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Normalised innovation squared, 1 or 0 for accepted, and S^-1 (3, 3) with S = `expected` (H P H') + `noise`."""
    inverse = inverse_of_symmetric_3(expected + noise)
    nis = use * ca.dot(residual, ca.mtimes(inverse, residual))
    return nis, use * (nis < GATE_3), inverse


def matched_covariance(matched: ca.SX, noise: ca.SX, inverse: ca.SX, shortened: ca.SX, weight: ca.SX) -> ca.SX:
    """Next matched covariance (3, 3), see the module's text.

    Args:
        matched: (3, 3) the present one.
        noise: (3, 3) R in use (the present one within its bounds).
        inverse: (3, 3) S^-1.
        shortened: (3,) innovation, shortened to the gate.
        weight: 0..1, weight of this innovation.
    """
    gain = ca.mtimes(noise, inverse)
    after = ca.mtimes(gain, shortened)
    sample = ca.mtimes(after, after.T) + noise - ca.mtimes(gain, noise)
    return symmetric(matched + weight * (sample - matched))


def joseph_update(covariance: Matrix, jacobian: Matrix, noise: Matrix, allowed: Matrix) -> tuple[Matrix, Matrix]:
    """Gain K (n, 3) and covariance (I - K H) P (I - K H)' + K R K' (n, n) after the update.

    The Joseph form holds for any gain, so that a state can be held without lying about its uncertainty (Schmidt 1966).

    Args:
        covariance: (n, n) P.
        jacobian: (3, n) H.
        noise: (3, 3) R.
        allowed: (n, n) matrix on the optimal gain; the identity leaves it, zero refuses the measurement.
    """
    cross = ca.mtimes(covariance, jacobian.T)
    inverse = inverse_of_symmetric_3(ca.mtimes(jacobian, cross) + noise)
    gain = ca.mtimes(allowed, ca.mtimes(cross, inverse))
    left = covariance - ca.mtimes(gain, cross.T)
    return gain, symmetric(left - ca.mtimes(ca.mtimes(left, jacobian.T) - ca.mtimes(gain, noise), gain.T))
