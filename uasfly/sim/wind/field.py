"""The wind at the vehicle: everything the plant asks of the air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.sim.wind.dryden import DrydenGusts
from uasfly.sim.wind.jets import Jet, Vector
from uasfly.sim.wind.settings import WindSettings
from uasfly.sim.wind.sines import SumOfSines
from uasfly.sim.wind.steady import SteadyWind


@dataclass(frozen=True, slots=True)
class WindAtVehicle:
    """Velocity of the air at the vehicle, world ENU.

    Attributes:
        free_in_world: (x, y, z) m/s, mean wind and gusts: they fill the whole air around the vehicle.
        jet_in_world: (x, y, z) m/s, sum of the blower jets: narrow, they act on the body, not on the whole rotor discs.
    """

    free_in_world: Vector
    jet_in_world: Vector


class WindField:
    """All the wind of one flight, to be stepped with the plant.

    The same generator state and the same arguments give the same sequence bit for bit. The number of random numbers
    drawn depends on the settings and the number of steps only, never on where the vehicle is.

    Args:
        settings: what the scenario file says.
        rng: source of all noise.
        step_s: time between two calls of `step` [s], greater than 0.
    """

    def __init__(self, settings: WindSettings, rng: np.random.Generator, step_s: float) -> None:
        self._steady = SteadyWind(settings.mean)
        self._along_x, self._along_y = self._steady.direction_in_world
        self._gusts: DrydenGusts | SumOfSines | None = None
        if settings.gusts != "none":
            kind = DrydenGusts if settings.gusts == "dryden" else SumOfSines
            self._gusts = kind(self._steady.w20_m_s, rng, step_s)
        self._jets = tuple(Jet(jet, rng, step_s) for jet in settings.jets)

    def step(self, position_in_world: Vector, velocity_in_world: Vector, engaged_time_s: float | None) -> WindAtVehicle:
        """Wind at the vehicle, one step later.

        Args:
            position_in_world: the vehicle [m]; z is its height above the ground.
            velocity_in_world: its velocity [m/s]; gusts pass at the speed relative to the mean wind.
            engaged_time_s: seconds since the vehicle first entered offboard, None before. Wind and gusts always blow;
                the jets' schedules run on this stop watch.
        """
        x, y, z = self._steady.at(position_in_world[2])
        if self._gusts is not None:
            vx, vy, vz = velocity_in_world
            u, v, w = self._gusts.step(position_in_world[2], math.sqrt((x - vx) ** 2 + (y - vy) ** 2 + (z - vz) ** 2))
            x += self._along_x * u - self._along_y * v
            y += self._along_y * u + self._along_x * v
            z += w
        jet_x = jet_y = jet_z = 0.0
        for jet in self._jets:
            dx, dy, dz = jet.step(position_in_world, engaged_time_s)
            jet_x += dx
            jet_y += dy
            jet_z += dz
        return WindAtVehicle((x, y, z), (jet_x, jet_y, jet_z))
