"""Information that is none: scatter of the attitude looks like tilts, and a vehicle at rest would calibrate itself.

The derivatives are taken at attitudes that are a bit wrong, so their squares are too large by what the scatter adds.
That is taken off the information (corrected score of errors-in-variables models; Nakamura 1990, Biometrika 77), at its
upper bound: as if the drift did not take some of it already. What then is left is what the vehicle's true motion tells.
"""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.vision.calibration.mounting.drift import Noise, covariance
from uasfly.vision.calibration.mounting.model import BUNDLES, Linearised, Unknowns, linearise
from uasfly.vision.calibration.mounting.observations import Place, Sightings

_STEP_RAD = 1e-4


def pretended(
    linear: Linearised,
    unknowns: Unknowns,
    place: Place,
    sightings: Sightings,
    errors: Array,
    weights: Array,
    noise: Noise,
) -> Array:
    """Information (size, size) of the unknowns that the attitude's scatter pretends.

    Args:
        linear: at these unknowns.
        unknowns: the solution.
        place: of the vehicle.
        sightings: what was seen.
        errors: (n, 6) of the motion.
        weights: (n,) of the sightings.
        noise: disturbances.
    """
    seen = noise.sighting_scale**2 * np.trace(linear.seen[:, 3:, 3:], axis1=1, axis2=2) / 3.0
    scatter = noise.attitude_rad**2 + 1.0 / (noise.wander_rad**-2 + 1.0 / seen)
    root = np.linalg.cholesky(covariance(linear, noise))
    total = np.zeros((unknowns.size, unknowns.size))
    for axis in range(3):
        moved = errors.copy()
        moved[:, 3 + axis] += _STEP_RAD
        other = linearise(unknowns, place, sightings, moved).by_unknowns
        slope = np.linalg.solve(root, (other - linear.by_unknowns) / _STEP_RAD)
        slope *= np.sqrt(weights * scatter)[:, None, None]
        flat = slope.reshape(-1, unknowns.size)
        total += flat.T @ flat
    return total


def known_covariance(information: Array, pretence: Array, believed: Array) -> Array:
    """Covariance (8, 8) of mounting, heading error and time offset, the bundles' places taken out.

    Args:
        information: (size, size) of log and belief.
        pretence: (size, size) share of it that is none.
        believed: (size,) of it, what was believed before: where the log tells nothing this remains.
    """
    total = information - pretence
    core, rest = slice(0, BUNDLES), slice(BUNDLES, None)
    reduced = total[core, core] - total[core, rest] @ np.linalg.solve(total[rest, rest], total[rest, core])
    scale = 1.0 / np.sqrt(believed[core])
    told = scale[:, None] * reduced * scale - np.eye(BUNDLES)
    values, vectors = np.linalg.eigh(0.5 * (told + told.T))
    sides = scale[:, None] * vectors
    return np.asarray(sides / (1.0 + np.maximum(values, 0.0)) @ sides.T, dtype=float)
