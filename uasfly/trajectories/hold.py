"""A point to stay at: the reference while nothing else is asked for."""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array, ReferenceHorizon


class HoldTrajectory:
    """Stay at a position with a yaw, at any time."""

    def __init__(self, position_in_world: Array, yaw_rad: float) -> None:
        """Take the (3,) position [m] and the yaw [rad]."""
        self.position_in_world = np.array(position_in_world, dtype=np.float64)
        self.yaw_rad = yaw_rad

    def sample(self, times_s: Array) -> ReferenceHorizon:
        """The same reference at each of the (n,) times."""
        n = len(times_s)
        zeros = np.zeros((n, 3))
        return ReferenceHorizon(
            times_s,
            np.tile(self.position_in_world, (n, 1)),
            zeros,
            zeros,
            np.full(n, self.yaw_rad),
            np.zeros(n),
        )
