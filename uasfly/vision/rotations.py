"""Rotations of many things at once: exponential map, its right Jacobian and cross-product matrices, vectorised.

The right Jacobian J of the exponential map (Chirikjian 2012, eq. 10.86) takes a change of a rotation vector to the
small turn that it adds on the right: exp(v + d) = exp(v) exp(J(v) d) to first order. So a solver may add to rotation
vectors and still have exact derivatives.
"""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array

_SMALL = 1e-4


def skews(vectors: Array) -> Array:
    """Matrices (..., 3, 3) with skews(a) @ b == cross(a, b), of vectors (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    zero = np.zeros_like(x)
    rows = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), axis=-1)
    return np.asarray(rows.reshape(*np.shape(vectors)[:-1], 3, 3), dtype=float)


def rotations(vectors: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad] (Rodrigues)."""
    sine, cosine, _ = _coefficients(vectors)
    crosses = skews(vectors)
    return np.asarray(np.eye(3) + sine * crosses + cosine * crosses @ crosses, dtype=float)


def right_jacobians(vectors: Array) -> Array:
    """Right Jacobians (..., 3, 3) of the exponential map at rotation vectors (..., 3) [rad]."""
    _, cosine, rest = _coefficients(vectors)
    crosses = skews(vectors)
    return np.asarray(np.eye(3) - cosine * crosses + rest * crosses @ crosses, dtype=float)


def _coefficients(vectors: Array) -> tuple[Array, Array, Array]:
    """sin(a)/a, (1 - cos(a))/a^2 and (a - sin(a))/a^3 of the angles a, (..., 1, 1)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    small = angle < _SMALL
    safe = np.where(small, 1.0, angle)
    sine = np.where(small, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    cosine = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    rest = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return sine, cosine, rest
