"""The frame of a mission that hangs on a marker: level, whatever the page does (see `uasfly.mission`)."""

from __future__ import annotations

import math

from uasfly.frames import rotation_matrix
from uasfly.messages import Array
from uasfly.trajectories.placement import Placement
from uasfly.trajectories.yaw import nearest_turn

FLAT = math.cos(math.radians(45.0))
RIGHT, UP, OUT = range(3)  # columns of the marker's rotation: axes of the page


def lies_flat(quaternion_marker_to_world: Array) -> bool:
    """Whether the page lies (or hangs under a deck) rather than stands: its normal is within 45 deg of the vertical."""
    return abs(float(rotation_matrix(quaternion_marker_to_world)[2, OUT])) > FLAT


def level_frame(position_in_world: Array, quaternion_marker_to_world: Array, flat: bool, near_rad: float) -> Placement:
    """Where the mission's frame lies.

    Args:
        position_in_world: (3,) m, of the marker.
        quaternion_marker_to_world: (4,).
        flat: which axis of the page gives x, its upper edge (flat) or its normal. Decided once: a page that leans by
            45 deg must not turn the mission round when its pose is refined.
        near_rad: of the equal headings the nearest to this one is taken.
    """
    x, y, _ = rotation_matrix(quaternion_marker_to_world)[:, UP if flat else OUT].tolist()
    return Placement(position_in_world, nearest_turn(math.atan2(y, x), near_rad))
