"""Markers in the filter: first sight and sightings (Kalaitzakis & Vitzilaios 2023, eq. 3 and 7).

A marker at rest in the world is one pose in the state. It sleeps (is not there at all) until it is first seen; then its
pose, its covariance and its correlation with everything else follow from the sighting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.observer import functions
from uasfly.observer import states as s
from uasfly.observer.door import Sighting


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
        self._location = functions.Caller(functions.marker_location())
        self._steps: dict[int, list[functions.Caller]] = {}
        self._inputs, self._outputs = np.empty(s.SIGHTING_INPUTS), np.empty(s.SIGHTING_OUTPUTS)

    def prepare(self, steps: functions.Steps) -> None:
        """Take the functions for some number of markers."""
        self._steps[len(steps.sightings)] = [functions.Caller(step) for step in steps.sightings]

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

        Args:
            packed: state at the sighting's time.
            markers: how many markers it holds; `prepare` has been called for so many.
            index: which of them is seen.
            sighting: what was seen.
            scale: factor on the sighting's covariance, from the matching so far.
            weight: 0..1, weight of this innovation in the matching.
        """
        inputs, outputs, result = self._inputs, self._outputs, np.empty(packed.size)
        inputs[s.IN_SIGHTING] = sighting.pose
        inputs[s.IN_SIGHTING_COVARIANCE] = sighting.covariance.ravel()
        inputs[s.IN_SCALE], inputs[s.IN_SIGHTING_WEIGHT] = scale, weight
        self._steps[markers][index]((packed, inputs), (result, outputs))
        nis, accepted, scale = outputs[: s.OUT_SIGHTING_SCALE + 1].tolist()
        taken = accepted > 0.5
        return SightingResult(result if taken else packed, scale, nis, taken, outputs[s.OUT_SIGHTING_INNOVATION].copy())
