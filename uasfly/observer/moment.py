"""What the filter knows at one time, and what its gates said."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from uasfly.message_class import message
from uasfly.messages import Array
from uasfly.observer import states as s
from uasfly.observer.accelerometer import AccelerometerMemory
from uasfly.observer.door import Measurement, Sighting
from uasfly.observer.gusts import Gusts


@message
class Moment:
    """The filter at one time, after the measurement of that time.

    Attributes:
        time_s: the time.
        packed: state, see states.Layout.
        markers: ids of the markers in the state, in their order there.
        scales: factors on the sightings' covariances, one a marker.
        airborne: whether the prediction up to here was of flight.
        rate: (3,) rad/s, body, last measured.
        rate_s: when it was measured.
        odometry_s: last odometry sample.
        sighted_s: last accepted sighting of each marker.
        measured: what was measured here; None for a mere prediction.
        gusts: how they were up to here.
        accelerometer: what was learnt of it up to here.
    """

    time_s: float
    packed: Array
    markers: tuple[int, ...]
    scales: tuple[float, ...]
    airborne: bool
    rate: tuple[float, ...]
    rate_s: float
    odometry_s: float
    sighted_s: tuple[float, ...]
    measured: Measurement | None
    gusts: Gusts
    accelerometer: AccelerometerMemory

    @property
    def layout(self) -> s.Layout:
        """How `packed` is laid out."""
        return s.layout(len(self.markers))

    @property
    def variances(self) -> tuple[list[float], list[float]]:
        """Diagonal (n,) of the covariance, and the covariances (3,) of position and GNSS bias, axis by axis."""
        first, n = self.layout.covariance.start, self.layout.errors
        diagonal: list[float] = self.packed[first : first + n * n : n + 1].tolist()
        start = first + s.D_BIAS.start * n + s.D_POSITION.start
        return diagonal, self.packed[start : start + 2 * n + 3 : n + 1].tolist()

    @property
    def position_sigma_m(self) -> float:
        """Standard deviation of the measured position's noise, as matched; mean of the axes."""
        start = self.layout.matched.start + 9 * s.POSITION_SENSOR
        total: float = sum(self.packed[start : start + 9 : 4].tolist())
        return math.sqrt(max(0.0, total) / 3.0)

    def without(self, marker_id: int) -> Moment:
        """The same filter without one of its markers: what it knows of the rest stays."""
        measured = self.measured
        if isinstance(measured, Sighting) and measured.marker_id == marker_id:
            measured = None
        if marker_id not in self.markers:
            return replace(self, measured=measured)
        index, layout = self.markers.index(marker_id), self.layout
        keep = np.delete(np.arange(layout.errors), s.marker_error(index))
        P = self.packed[layout.covariance].reshape(layout.errors, layout.errors)
        nominal = np.delete(self.packed[layout.nominal], s.marker_nominal(index))
        return replace(
            self,
            packed=np.concatenate((nominal, P[np.ix_(keep, keep)].ravel(), self.packed[layout.matched.start :])),
            markers=self.markers[:index] + self.markers[index + 1 :],
            scales=self.scales[:index] + self.scales[index + 1 :],
            sighted_s=self.sighted_s[:index] + self.sighted_s[index + 1 :],
            measured=measured,
        )


@dataclass(slots=True)
class Verdict:
    """What the gate said of one sensor: normalised innovation squared, degrees of freedom, accepted or not.

    A sighting also says how far away [m] and how turned [rad] the marker is against where the filter has it.
    """

    sensor: str
    nis: float
    dof: int
    accepted: bool
    away_m: float = 0.0
    turned_rad: float = 0.0
