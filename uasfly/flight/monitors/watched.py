"""What the monitors look at."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.flight.view import VehicleView
from uasfly.messages import Array, Authority, StateEstimate
from uasfly.observer.diagnosis import Diagnosis
from uasfly.observer.sightings import MarkerEstimate
from uasfly.wind_messages import WindEstimate


@dataclass(slots=True)
class Watched:
    """One cycle.

    Attributes:
        time_s: now, host time.
        flying: uasfly's setpoints fly the vehicle now.
        estimate, diagnosis: of the observer, for now.
        view: what the vehicle has said.
        origin: (3,) m, world: what geofence and altitudes count from.
        home: (3,) m, world: where the vehicle stood before take-off, or was first met.
        reference: (3,) m, world: where it should be now; None where nothing asks for a place.
        authority: what the wind has taken.
        marker: that the mission hangs on, None where the filter does not know it.
        by_marker: the mission hangs on a marker, and has begun.
        wind: None where it is not known.
        carried: something else than the air carries the vehicle.
    """

    time_s: float
    flying: bool
    estimate: StateEstimate
    diagnosis: Diagnosis
    view: VehicleView
    origin: Array
    home: Array
    reference: Array | None
    authority: Authority
    marker: MarkerEstimate | None = None
    by_marker: bool = False
    wind: WindEstimate | None = None
    carried: bool = False
