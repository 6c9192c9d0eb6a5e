"""What the last sightings of each marker said: whether they contradict where the filter has it, and by how much.

And a marker of the filter as the flight sees it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from uasfly.frames import rotation_matrix
from uasfly.messages import Array
from uasfly.observer import states as s
from uasfly.observer.moment import Moment, Verdict

KEPT = 10  # sightings: a third of a second at 30 Hz
KEPT_S = 1.0  # and none that is older
FEWEST = 3


@dataclass(frozen=True, slots=True)
class Contradiction:
    """How the last sightings of a marker differ from the filter.

    Attributes:
        rejected_share: of them, outside the gate; 0 while there are fewer than FEWEST.
        away_m, turned_rad: mean distance and mean turn between the marker as seen and as the filter has it.
    """

    rejected_share: float = 0.0
    away_m: float = 0.0
    turned_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class MarkerEstimate:
    """A marker that is in the filter.

    Attributes:
        marker_id: which.
        position_in_world: (3,) m. quaternion_marker_to_world: (4,).
        position_sigma_m: of its position against the vehicle's, largest axis.
        heading_sigma_rad: of its turn about the vertical.
        seen_s: time of the last sighting that was accepted.
        contradiction: what the last sightings say against it.
    """

    marker_id: int
    position_in_world: Array
    quaternion_marker_to_world: Array
    position_sigma_m: float
    heading_sigma_rad: float
    seen_s: float
    contradiction: Contradiction


class SightingLog:
    """The last sightings of each marker."""

    def __init__(self) -> None:
        self._entries: dict[int, deque[tuple[float, Verdict]]] = {}

    def note(self, time_s: float, marker_id: int, verdict: Verdict) -> None:
        """A sighting was looked at."""
        entries = self._entries.get(marker_id)
        if entries is None:
            entries = self._entries[marker_id] = deque(maxlen=KEPT)
        entries.append((time_s, verdict))

    def forget(self, marker_id: int) -> None:
        """Begin anew."""
        self._entries.pop(marker_id, None)

    def contradiction(self, marker_id: int, time_s: float) -> Contradiction:
        """What they say at a time."""
        recent = [v for t, v in self._entries.get(marker_id, ()) if time_s - t <= KEPT_S]
        count = len(recent)
        if count < FEWEST:
            return Contradiction()
        return Contradiction(
            sum(not v.accepted for v in recent) / count,
            sum(v.away_m for v in recent) / count,
            sum(v.turned_rad for v in recent) / count,
        )


def marker_estimate(moment: Moment, marker_id: int, contradiction: Contradiction) -> MarkerEstimate | None:
    """A marker at a moment of the filter, None where the filter does not know it."""
    if marker_id not in moment.markers:
        return None
    index = moment.markers.index(marker_id)
    pose, layout, error = moment.packed[s.marker_nominal(index)], moment.layout, s.marker_error(index)
    P = moment.packed[layout.covariance].reshape(layout.errors, layout.errors)
    variances = [
        float(P[marker, marker] + P[vehicle, vehicle] - 2.0 * P[marker, vehicle])
        for marker, vehicle in zip(range(error.start, error.start + 3), range(3), strict=True)
    ]
    vertical = rotation_matrix(pose[3:])[2]  # the world's z axis in the marker's frame
    turn = P[error.start + 3 : error.stop, error.start + 3 : error.stop]
    return MarkerEstimate(
        marker_id=moment.markers[index],
        position_in_world=pose[:3].copy(),
        quaternion_marker_to_world=pose[3:].copy(),
        position_sigma_m=math.sqrt(max(0.0, *variances)),
        heading_sigma_rad=math.sqrt(max(0.0, float(vertical @ turn @ vertical))),
        seen_s=moment.sighted_s[index],
        contradiction=contradiction,
    )
