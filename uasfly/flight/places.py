"""The places that a flight counts from: where the vehicle stood, where it was first known, and the origin of these."""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array, StateEstimate


class Places:
    """Places of one flight.

    Args:
        frame: of the mission; in "local" the origin is PX4's.
    """

    def __init__(self, frame: str) -> None:
        self._is_local = frame == "local"
        self._ground: Array | None = None  # where the vehicle last stood
        self._home: Array | None = None

    def note(self, estimate: StateEstimate, *, stands: bool) -> None:
        """Take in where the vehicle is; call it in each cycle in which that is known."""
        if stands:
            self._ground = self._home = estimate.position_in_world
        elif self._home is None:
            self._home = estimate.position_in_world

    @property
    def home(self) -> Array:
        """Where the vehicle stood before it took off, or was first met: (3,) m, world; it must have been noted once."""
        assert self._home is not None
        return self._home

    def origin(self, estimate: StateEstimate, *, takes_off: bool = False) -> Array:
        """What the mission, the geofence and altitudes count from: (3,) m, world.

        Args:
            estimate: for now.
            takes_off: whether the vehicle takes off from where it is now.
        """
        if self._is_local:
            return np.zeros(3)
        if takes_off:
            return estimate.position_in_world
        if self._ground is not None:
            return self._ground
        x, y, _ = estimate.position_in_world.tolist()
        return np.array((x, y, 0.0))  # met in the air: PX4's local origin lies on the ground where it booted
