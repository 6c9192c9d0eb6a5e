"""The one form of all references: a table of pieces in time, each a cubic plus harmonics of a cubic phase.

In a piece, with t from its start, position and phase theta are cubic polynomials of t (constant jerk), and

    p = cubic(t) + a1 cos(theta) + b1 sin(theta) + a2 cos(2 theta) + b2 sin(2 theta).

Straight motion needs the cubic alone, circles and spirals the first harmonic, eights the second. Velocity and
acceleration are the exact derivatives. With one table for a whole mission a horizon is one call of generated code.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from uasfly.messages import Array
from uasfly.trajectories.piece_motion import COLUMNS, HARMONICS, MotionSampler
from uasfly.trajectories.placement import Placement

CUBIC = slice(0, 3)  # columns of a polynomial: x, y, z [m]
PHASE = 3  # [rad]
CHUNK = 256  # times sampled at once


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


class PieceTable:
    """Samples pieces at many times at once; one table is for one thread.

    Args:
        pieces: the pieces; the last one should end at rest, for it holds its end afterwards.
        placement: where the pieces' frame lies; what is sampled is in the frame that it lies in.
    """

    def __init__(self, pieces: Pieces, placement: Placement | None = None) -> None:
        ends = np.cumsum(pieces.durations_s)
        self.duration_s = float(ends[-1]) if ends.size else 0.0
        self._starts = np.concatenate(([0.0], ends[:-1]))
        self._start_list: list[float] = self._starts.tolist()
        polynomials, harmonics = pieces.polynomials.copy(), pieces.harmonics
        if placement is not None:
            polynomials[:, :, CUBIC] = placement.turned(polynomials[:, :, CUBIC])
            polynomials[:, 0, CUBIC] += placement.origin
            harmonics = placement.turned(harmonics)
        count = len(polynomials)
        self._pieces = np.hstack((polynomials.reshape(count, -1), harmonics.reshape(count, -1)))
        self._samplers: dict[int, MotionSampler] = {}  # by the number of times
        self._one = MotionSampler(1)

    def sample(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Position [m], velocity [m/s] and acceleration [m/s^2], each (n, 3), at (n,) times [s], which are clamped."""
        if times_s.size > CHUNK:
            chunks = [self.sample(times_s[first : first + CHUNK]) for first in range(0, times_s.size, CHUNK)]
            position, velocity, acceleration = (np.concatenate(arrays) for arrays in zip(*chunks, strict=True))
            return position, velocity, acceleration
        sampler = self._samplers.get(times_s.size)
        if sampler is None:
            if not times_s.size:
                return np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3))
            sampler = self._samplers[times_s.size] = MotionSampler(times_s.size)
        times = np.minimum(np.maximum(times_s, 0.0), self.duration_s)
        index = self._starts.searchsorted(times, "right") - 1
        np.subtract(times, self._starts.take(index), out=sampler.times_s)
        self._pieces.take(index, axis=0, out=sampler.pieces, mode="clip")  # no index is clipped: this mode is direct
        sampler.evaluate()
        return sampler.position.copy(), sampler.velocity.copy(), sampler.acceleration.copy()

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Position [m] at one time [s], clamped, without arrays."""
        time_s = min(max(time_s, 0.0), self.duration_s)
        piece = bisect_right(self._start_list, time_s) - 1
        sampler = self._one
        sampler.times_s[0], sampler.pieces[0] = time_s - self._start_list[piece], self._pieces[piece]
        sampler.evaluate()
        x, y, z = sampler.position[0].tolist()
        return x, y, z
