"""Where a mission's frame lies in the world: moved, and turned about the vertical."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class Placement:
    """Origin and heading of a frame whose z axis points up.

    Attributes:
        origin: (3,) m, world.
        heading_rad: of the frame's x axis in the world; 0 is east, counter-clockwise positive.
    """

    origin: Array
    heading_rad: float = 0.0

    def turned(self, vectors: Array) -> Array:
        """Vectors (..., 3) of the frame along the world's axes; the same object where the frame is not turned."""
        if self.heading_rad == 0.0:
            return vectors
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        result = vectors.copy()
        result[..., 0] = cosine * vectors[..., 0] - sine * vectors[..., 1]
        result[..., 1] = sine * vectors[..., 0] + cosine * vectors[..., 1]
        return result

    def to_world(self, points: Array) -> Array:
        """Points (..., 3) [m] of the frame, in the world."""
        return self.origin + self.turned(points)

    def from_world(self, points: Array) -> Array:
        """Points (..., 3) [m] of the world, in the frame."""
        return Placement(self.origin, -self.heading_rad).turned(points - self.origin)


AT_ORIGIN = Placement(np.zeros(3))
