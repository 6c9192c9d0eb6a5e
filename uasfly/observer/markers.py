"""Markers in the filter: first sight and sightings (Kalaitzakis & Vitzilaios 2023, eq. 3 and 7).

A marker at rest in the world is one pose in the state. It sleeps (is not there at all) until it is first seen; then its
pose, its covariance and its correlation with everything else follow from the sighting. Sightings come at camera rates,
so the algebra is plain numpy for any number of markers; geometry and Jacobians are generated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.observer import functions
from uasfly.observer import states as s
from uasfly.observer.door import Sighting
from uasfly.observer.update import GATE_6

# Bounds of the factor by which the matching may scale the covariance that a sighting brings along.
SCALE_MIN, SCALE_MAX = 0.1, 1e6


@dataclass(frozen=True, slots=True)
class SightingResult:
    """Outcome of a sighting of a known marker: new packed state, scale of its noise, innovation test and innovation."""

    packed: Array
    scale: float
    nis: float
    accepted: bool
    innovation: Array


class MarkerAlgebra:
    """First sight and update of marker poses on the packed state."""

    def __init__(self) -> None:
        self._geometry = functions.Caller(functions.marker_geometry())
        self._location = functions.Caller(functions.marker_location())
        self._inject: dict[int, functions.Caller] = {}

    def first_sight(self, packed: Array, markers: int, sighting: Sighting) -> Array:
        """Packed state of `markers` + 1 markers: the new one located by eq. 7 turned round.

        With J the derivative of the marker's pose by the core error and N by the sighting's: its covariance is
        J P J' + N R N', its correlation with the rest of the state J P.
        """
        old, new = s.Layout(markers), s.Layout(markers + 1)
        pose, by_core, by_noise = np.empty(7), np.empty(6 * s.CORE_ERROR), np.empty(36)
        self._location((packed, sighting.pose), (pose, by_core, by_noise))
        J, N = by_core.reshape(6, s.CORE_ERROR, order="F"), by_noise.reshape(6, 6, order="F")
        P = packed[old.covariance].reshape(old.errors, old.errors)
        cross = J @ P[: s.CORE_ERROR]
        own = cross[:, : s.CORE_ERROR] @ J.T + N @ sighting.covariance @ N.T
        grown = np.empty((new.errors, new.errors))
        grown[: old.errors, : old.errors] = P
        grown[old.errors :, : old.errors] = cross
        grown[: old.errors, old.errors :] = cross.T
        grown[old.errors :, old.errors :] = 0.5 * (own + own.T)
        return np.concatenate((packed[old.nominal], pose, grown.ravel(), packed[old.matched.start :]))

    def sighting(
        self, packed: Array, markers: int, index: int, sighting: Sighting, scale: float, weight: float
    ) -> SightingResult:
        """Update by a sighting of the marker in place `index`, gated; Joseph form, reset Jacobian.

        The covariance matching (eq. 8, 9 in the form of `update`) is of one number, the scale of the covariance that
        the detector states, because that covariance itself changes with distance and view.

        Args:
            packed: state at the sighting's time.
            markers: how many markers it holds.
            index: which of them is seen.
            sighting: what was seen.
            scale: factor on the sighting's covariance, from the matching so far.
            weight: 0..1, weight of this innovation in the matching.
        """
        layout = s.Layout(markers)
        innovation, by_core, by_marker = np.empty(6), np.empty(6 * s.CORE_ERROR), np.empty(36)
        pose = packed[s.marker_nominal(index)]
        self._geometry((packed, pose, sighting.pose), (innovation, by_core, by_marker))
        H = np.zeros((6, layout.errors))
        H[:, : s.CORE_ERROR] = by_core.reshape(6, s.CORE_ERROR, order="F")
        H[:, s.marker_error(index)] = by_marker.reshape(6, 6, order="F")
        P = packed[layout.covariance].reshape(layout.errors, layout.errors)
        R = min(max(scale, SCALE_MIN), SCALE_MAX) * sighting.covariance
        cross = P @ H.T
        inverse = np.linalg.inv(H @ cross + R).astype(np.float64, copy=False)
        nis = float(innovation @ inverse @ innovation)
        accepted = nis < GATE_6
        next_scale = scale + weight * (_scale_sample(R, inverse, innovation, nis, sighting.covariance) - scale)
        if not accepted:
            return SightingResult(packed, next_scale, nis, False, innovation)
        K = cross @ inverse
        left = np.eye(layout.errors) - K @ H
        P = left @ P @ left.T + K @ R @ K.T
        result = packed.copy()
        if markers not in self._inject:
            self._inject[markers] = functions.Caller(functions.injection(markers))
        self._inject[markers](
            (packed, np.ascontiguousarray(0.5 * (P + P.T)), K @ innovation),
            (result[layout.nominal], result[layout.covariance]),
        )
        return SightingResult(result, next_scale, nis, True, innovation)


def _scale_sample(R: Array, inverse: Array, innovation: Array, nis: float, stated: Array) -> float:
    """What one innovation says about the scale: the matched sample (see `update`) in units of the stated covariance."""
    gain = R @ inverse
    after = gain @ innovation * min(1.0, GATE_6 / max(nis, GATE_6)) ** 0.5
    sample = np.outer(after, after) + R - gain @ R
    return float(np.trace(np.linalg.solve(stated, sample))) / s.MARKER_DOF
