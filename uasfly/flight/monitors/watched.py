"""What the monitors look at, once a cycle."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.control.protocol import ControlResult
from uasfly.flight.view import VehicleView
from uasfly.messages import Array, Authority, StateEstimate
from uasfly.observer.diagnosis import Diagnosis


@dataclass(slots=True)
class Watched:
    """One cycle.

    Attributes:
        time_s: now, host time.
        flying: uasfly's setpoints fly the vehicle now.
        estimate, diagnosis: of the observer, for now.
        view: what the vehicle has said.
        origin: (3,) m, of the mission, in the world.
        home: (3,) m, world: where the vehicle stood before take-off, or was first met.
        reference: (3,) m, world: where it should be now; None where nothing asks for a place.
        control: the last step's result, None where nothing was controlled.
        authority: what the wind has taken.
    """

    time_s: float
    flying: bool
    estimate: StateEstimate
    diagnosis: Diagnosis
    view: VehicleView
    origin: Array
    home: Array
    reference: Array | None
    control: ControlResult | None
    authority: Authority
