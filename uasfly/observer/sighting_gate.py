"""A sighting of a marker, number by number: its gate, and the matched scale of its noise."""

from __future__ import annotations

import casadi as ca

from uasfly.observer import measurements as me
from uasfly.observer import states as s
from uasfly.observer.update import GATE_6

# Bounds of the factor by which the matching may scale the covariance that a sighting brings along.
SCALE_MIN, SCALE_MAX = 0.1, 1e6


def geometry(core: ca.SX, marker: ca.SX, relative: ca.SX) -> list[ca.SX]:
    """Innovation (6,), H by core (6, 21) and H by marker (6, 6) of eq. 7."""
    return [me.marker_innovation(core, marker, relative), *me.marker_jacobians(core, marker)]


def noise(inputs: ca.SX) -> list[ca.SX]:
    """R (6, 6): what the sighting states, scaled as matched."""
    return [_bounded(inputs[s.IN_SCALE]) * ca.reshape(inputs[s.IN_SIGHTING_COVARIANCE], 6, 6)]


def gate(innovation: ca.SX, total: ca.SX, inputs: ca.SX) -> list[ca.SX]:
    """What becomes of an innovation (6,) whose covariance is `total` (6, 6), S = H P H' + R.

    The covariance matching (eq. 8, 9 in the form of `update`) is of one number, the scale of the covariance C that the
    detector states, because that covariance itself changes with distance and view: trace(C^-1 sample) / 6 of the
    matched sample, with R = scale C.

    Returns:
        S^-1 (6, 6), 0 where the innovation is refused, and (normalised innovation squared, 1 or 0 for accepted, next
        scale).
    """
    scale, weight = inputs[s.IN_SCALE], inputs[s.IN_SIGHTING_WEIGHT]
    used = _bounded(scale)
    stated = ca.reshape(inputs[s.IN_SIGHTING_COVARIANCE], 6, 6)
    root = ca.solve(ca.chol(total).T, ca.SX.eye(6))  # S = U' U with U upper triangular, S^-1 = root' root
    inverse = ca.mtimes(root.T, root)
    solved = ca.mtimes(inverse, innovation)
    nis = ca.dot(innovation, solved)
    accepted = nis < GATE_6
    shortened = GATE_6 / ca.fmax(nis, GATE_6)
    after = used**2 * shortened * ca.dot(solved, ca.mtimes(stated, solved))
    sample = (after + used * s.MARKER_DOF - used**2 * ca.trace(ca.mtimes(inverse, stated))) / s.MARKER_DOF
    return [accepted * inverse, ca.vertcat(nis, accepted, scale + weight * (sample - scale))]


def _bounded(scale: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(scale, SCALE_MIN), SCALE_MAX)
