"""Where the search for a mounting begins: the camera file's, unless looking another way fits the turns far better."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from uasfly.messages import Array
from uasfly.vision.calibration.mounting.observations import Place, Sightings

_MOST = 200  # sightings that are looked at
_BETTER = 0.7  # of the misfit, from which on the stated mounting is given up
_LEAST_RAD = 0.1  # a stated mounting that fits like this is near enough


def first_rotation(stated: Array, place: Place, sightings: Sightings) -> Array:
    """Camera to body (3, 3): the stated one or, if that is clearly wrong, the best of those along the body's axes.

    From 90 degrees away the solver still finds its way; a mounting is never further from one of the 24.

    Args:
        stated: (3, 3) of the camera's file.
        place: of the vehicle at the sightings.
        sightings: of bundles at rest.
    """
    chosen = np.unique(np.linspace(0, len(sightings.time_s) - 1, _MOST).round().astype(np.intp))
    body, seen = Rotation.from_matrix(place.rotation[chosen]), Rotation.from_matrix(sightings.rotation[chosen])
    groups = [sightings.bundle[chosen] == index for index in range(len(sightings.ids))]

    def misfit(camera_to_body: Rotation) -> float:
        bundle = body * camera_to_body * seen
        away = np.zeros(len(chosen))
        for its in groups:
            if its.any():
                away[its] = (bundle[its].mean().inv() * bundle[its]).magnitude()
        return float(np.sqrt(np.mean(away**2)))

    first = misfit(Rotation.from_matrix(stated))
    if first < _LEAST_RAD:
        return stated
    others = list(Rotation.create_group("O"))
    misfits = [misfit(other) for other in others]
    best = int(np.argmin(misfits))
    return np.asarray(others[best].as_matrix(), dtype=float) if misfits[best] < _BETTER * first else stated
