"""The wind around the simulated vehicle: mean wind, Dryden gusts and blower jets. It gives velocities, never forces."""

from uasfly.sim.wind.field import WindAtVehicle, WindField
from uasfly.sim.wind.settings import WindSettings

__all__ = ["WindAtVehicle", "WindField", "WindSettings"]
