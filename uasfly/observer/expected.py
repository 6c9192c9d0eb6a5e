"""Where the filter expects a marker relative to the body: for the detector, which then looks there first."""

from __future__ import annotations

import math

import numpy as np

from uasfly.frames import quaternion_inverse, quaternion_product, rotation_matrix, skew
from uasfly.marker_prediction import MarkerPrediction
from uasfly.messages import Array
from uasfly.observer import states as s
from uasfly.observer.moment import Moment


def expected_marker(moment: Moment, core: Array, marker_id: int) -> MarkerPrediction | None:
    """A marker as it is to be seen (eq. 7 of Kalaitzakis & Vitzilaios 2023); None where the filter does not know it.

    Args:
        moment: of the filter; its covariance counts.
        core: (22,) nominal core state at the time that is meant.
        marker_id: which marker.
    """
    if marker_id not in moment.markers:
        return None
    index = moment.markers.index(marker_id)
    pose, layout, own = moment.packed[s.marker_nominal(index)], moment.layout, s.marker_error(index)
    to_body = rotation_matrix(core[s.QUATERNION]).T
    position = to_body @ (pose[:3] - core[s.POSITION])
    H = np.zeros((3, layout.errors))
    H[:, s.D_POSITION] = -to_body
    H[:, s.D_ATTITUDE] = skew(position)
    H[:, own.start : own.start + 3] = to_body
    P = moment.packed[layout.covariance].reshape(layout.errors, layout.errors)
    variances = np.einsum("ij,jk,ik->i", H, P, H)
    turned = quaternion_product(quaternion_inverse(core[s.QUATERNION]), pose[3:])
    return MarkerPrediction(position, turned, math.sqrt(max(0.0, float(variances.max()))))
