"""A turn in place, to look around: the reference while a marker is searched for."""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array, ReferenceHorizon
from uasfly.trajectories.hold import HoldTrajectory


class SearchTurn(HoldTrajectory):
    """Stay at a position and turn evenly; a `Pacing` starts and stops it smoothly."""

    def __init__(self, position_in_world: Array, yaw_rad: float, rate_rad_s: float) -> None:
        """Take the (3,) position [m], the yaw at time zero [rad] and the rate [rad/s]."""
        super().__init__(position_in_world, yaw_rad)
        self._rate_rad_s = rate_rad_s

    def yaw_at(self, time_s: float) -> float:
        """The heading [rad] at a time."""
        return self.yaw_rad + self._rate_rad_s * time_s

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """The reference at (n,) times."""
        held = super().sample(times_s)
        return ReferenceHorizon(
            times_s,
            held.position_in_world,
            held.velocity_in_world,
            held.acceleration_in_world,
            held.yaw_rad + self._rate_rad_s * times_s,
            np.full(len(times_s), self._rate_rad_s),
        )
