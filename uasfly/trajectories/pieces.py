"""The one form of all references: a table of pieces in time, each a cubic plus harmonics of a cubic phase.

In a piece, with t from its start, position and phase theta are cubic polynomials of t (constant jerk), and

    p = cubic(t) + a1 cos(theta) + b1 sin(theta) + a2 cos(2 theta) + b2 sin(2 theta).

Straight motion needs the cubic alone, circles and spirals the first harmonic, eights the second. Velocity and
acceleration are the exact derivatives. With one table for a whole mission a horizon is one call of generated code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from uasfly.messages import Array
from uasfly.trajectories.placement import Placement
from uasfly.trajectories.segments import Segments, segment_function

CUBIC = slice(0, 3)  # columns of a polynomial: x, y, z [m]
PHASE = 3  # [rad]
COLUMNS = 4
HARMONICS = 4  # cos, sin, cos of twice, sin of twice the phase


@dataclass(frozen=True, slots=True)
class Pieces:
    """n pieces, one after the other.

    Attributes:
        durations_s: (n,).
        polynomials: (n, 4, 4) coefficients of t^0..t^3 (rows) of x, y, z [m] and phase [rad] (columns).
        harmonics: (n, 4, 3) vectors [m] of cos, sin, cos of twice and sin of twice the phase.
    """

    durations_s: Array
    polynomials: Array
    harmonics: Array

    @property
    def duration_s(self) -> float:
        """Duration of all pieces [s]."""
        return float(self.durations_s.sum())


def straight_pieces(durations_s: Sequence[float], start: Array, jerks: Array) -> Pieces:
    """Pieces from rest at `start` (d,) under a constant jerk (n, d) each; d = 3 moves the position, d = 1 the phase."""
    columns = CUBIC if start.size == 3 else slice(PHASE, PHASE + 1)
    polynomials = np.zeros((len(durations_s), 4, COLUMNS))
    position, velocity, acceleration = start.copy(), np.zeros_like(start), np.zeros_like(start)
    for index, (t, jerk) in enumerate(zip(durations_s, jerks, strict=True)):
        polynomials[index, :, columns] = position, velocity, acceleration / 2.0, jerk / 6.0
        position = position + t * (velocity + t * (acceleration / 2.0 + t * jerk / 6.0))
        velocity = velocity + t * (acceleration + t * jerk / 2.0)
        acceleration = acceleration + t * jerk
    return Pieces(np.array(durations_s, dtype=float), polynomials, np.zeros((len(durations_s), HARMONICS, 3)))


def rest(position: Array, duration_s: float) -> Pieces:
    """Stand at a point (3,) [m]."""
    return straight_pieces([duration_s], position, np.zeros((1, 3)))


def concatenate(parts: Sequence[Pieces]) -> Pieces:
    """All parts, one after the other; pieces without duration are left out."""
    durations = np.concatenate([part.durations_s for part in parts])
    keep = durations > 0.0
    return Pieces(
        durations[keep],
        np.concatenate([part.polynomials for part in parts])[keep],
        np.concatenate([part.harmonics for part in parts])[keep],
    )


@lru_cache(maxsize=1)
def _piece_function() -> ca.Function:
    """Position [m], velocity [m/s] and acceleration [m/s^2] from polynomials (4, 4) and harmonics (4, 3) in one row."""

    def motion(t: ca.SX, row: ca.SX) -> list[ca.SX]:
        polynomials = ca.reshape(row[: 4 * COLUMNS], COLUMNS, 4)
        vectors = ca.reshape(row[4 * COLUMNS :], 3, HARMONICS)
        x, y, z, phase = ca.vertsplit(ca.mtimes(polynomials, ca.vertcat(1.0, t, t**2, t**3)))
        cosine, sine = ca.cos(phase), ca.sin(phase)
        harmonics = ca.vertcat(cosine, sine, cosine * cosine - sine * sine, 2.0 * cosine * sine)
        position = ca.vertcat(x, y, z) + ca.mtimes(vectors, harmonics)
        velocity = ca.jacobian(position, t)
        return [position, velocity, ca.jacobian(velocity, t)]

    return segment_function("uasfly_piece", 4 * COLUMNS + 3 * HARMONICS, motion)


class PieceTable:
    """Samples pieces at many times at once; one table is for one thread.

    Args:
        pieces: the pieces; the last one should end at rest, for it holds its end afterwards.
        placement: where the pieces' frame lies; what is sampled is in the frame that it lies in.
    """

    def __init__(self, pieces: Pieces, placement: Placement | None = None) -> None:
        polynomials, harmonics = pieces.polynomials.copy(), pieces.harmonics
        if placement is not None:
            polynomials[:, :, CUBIC] = placement.turned(polynomials[:, :, CUBIC])
            polynomials[:, 0, CUBIC] += placement.origin
            harmonics = placement.turned(harmonics)
        count = len(polynomials)
        rows = np.hstack((polynomials.reshape(count, -1), harmonics.reshape(count, -1)))
        self._segments = Segments(_piece_function(), pieces.durations_s, rows)
        self.duration_s = self._segments.duration_s

    def sample(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Position [m], velocity [m/s] and acceleration [m/s^2], each (n, 3), at (n,) times [s], which are clamped."""
        position, velocity, acceleration = self._segments.sample(times_s)
        return position, velocity, acceleration

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Position [m] at one time [s], clamped."""
        x, y, z = self._segments.sample_one(time_s)[0].tolist()
        return x, y, z
