"""Where the filter expects a marker: what the observer tells the detection, which then looks there first."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class MarkerPrediction:
    """A marker's (or bundle's) pose relative to the body as it is expected at a time.

    Attributes:
        position_in_body: (3,) m.
        quaternion_marker_to_body: (4,).
        sigma_m: standard deviation of the position, the largest axis.
    """

    position_in_body: Array
    quaternion_marker_to_body: Array
    sigma_m: float = 0.1
