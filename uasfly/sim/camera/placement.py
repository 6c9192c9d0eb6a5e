"""Where the bundle is in the world, at any time."""

from __future__ import annotations

import math

import numpy as np

from uasfly.messages import Array
from uasfly.sim.camera.settings import BundlePlacement


class PlacedBundle:
    """A bundle on a wall or on the floor, with its scheduled moves.

    Args:
        placement: what the scenario says.
    """

    def __init__(self, placement: BundlePlacement) -> None:
        self._moves = placement.moves
        self._position = np.array(placement.position_m, dtype=float)
        self._rotation = _page(placement)

    @property
    def first_position(self) -> Array:
        """(3,) m, world, before any move."""
        return self._position

    @property
    def first_rotation(self) -> Array:
        """(3, 3) bundle to world, before any move."""
        return self._rotation

    def pose(self, since_s: float) -> tuple[Array, Array]:
        """Position (3,) [m, world] and rotation (3, 3) from the bundle's axes to the world's.

        Args:
            since_s: time on the schedule's clock; negative before it runs.
        """
        position, turn_deg = self._position, 0.0
        for move in self._moves:
            if since_s < move.at_s:
                break
            share = 1.0 if since_s >= move.at_s + move.duration_s else (since_s - move.at_s) / move.duration_s
            position = position + share * np.array(move.offset_m)
            turn_deg += share * move.turn_deg
        if not turn_deg:
            return position, self._rotation
        return position, self._rotation @ _about_z(math.radians(turn_deg))


def _page(placement: BundlePlacement) -> Array:
    """Rotation (3, 3) of the page: its columns are the page's right, its up and the way out of it, in the world."""
    facing = math.radians(placement.facing_deg)
    ahead, above = np.array((math.cos(facing), math.sin(facing), 0.0)), np.array((0.0, 0.0, 1.0))
    up, out = (above, ahead) if placement.on == "wall" else (ahead, above)
    tilt = math.radians(placement.tilt_deg)
    up, out = math.cos(tilt) * up - math.sin(tilt) * out, math.cos(tilt) * out + math.sin(tilt) * up
    return np.column_stack((np.cross(up, out), up, out))


def _about_z(angle_rad: float) -> Array:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
