"""The one form of all references: a table of pieces in time, each a cubic plus harmonics of a cubic phase.

In a piece, with t from its start, position and phase theta are cubic polynomials of t (constant jerk), and

    p = cubic(t) + a1 cos(theta) + b1 sin(theta) + a2 cos(2 theta) + b2 sin(2 theta).

Straight motion needs the cubic alone, circles and spirals the first harmonic, eights the second. Velocity and
acceleration are the exact derivatives. One table for a whole mission makes sampling a handful of array operations.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uasfly.messages import Array
from uasfly.trajectories.placement import Placement

CUBIC = slice(0, 3)  # columns of a polynomial: x, y, z [m]
PHASE = 3  # [rad]
COLUMNS = 4
CHUNK = 4096  # times sampled at once
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


class PieceTable:
    """Samples pieces at many times at once.

    Args:
        pieces: the pieces; the last one should end at rest, for it holds its end afterwards.
        placement: where the pieces' frame lies; what is sampled is in the frame that it lies in.
    """

    def __init__(self, pieces: Pieces, placement: Placement | None = None) -> None:
        self._pieces = pieces
        ends = np.cumsum(pieces.durations_s)
        self.duration_s = float(ends[-1]) if ends.size else 0.0
        self._starts = np.concatenate(([0.0], ends[:-1]))
        polynomials, harmonics = pieces.polynomials.copy(), pieces.harmonics
        if placement is not None:
            polynomials[:, :, CUBIC] = placement.turned(polynomials[:, :, CUBIC])
            polynomials[:, 0, CUBIC] += placement.origin
            harmonics = placement.turned(harmonics)
        self._derivatives = np.ascontiguousarray(_polynomials_and_derivatives(polynomials).transpose(0, 2, 1))
        self._start_list: list[float] = self._starts.tolist()
        self._coefficients: list[list[list[float]]] = polynomials.transpose(0, 2, 1).tolist()
        distinct, groups = np.unique(harmonics.reshape(-1, HARMONICS * 3), axis=0, return_inverse=True)
        self._groups: NDArray[np.intp] = groups.reshape(-1)  # pieces of one leg share their harmonics
        self._group_list: list[int] = self._groups.tolist()
        vectors = distinct.reshape(-1, HARMONICS, 3)
        self._amplitudes: list[list[list[float]]] = vectors.tolist()
        self._harmonics = [HARMONICS if v[2:].any() else 2 if v.any() else 0 for v in vectors]
        self._vectors = _vectors_and_derivatives(vectors)

    def sample_long(self, times_s: Array) -> tuple[Array, Array, Array]:
        """The same as `sample` in bounded memory, for very many times."""
        chunks = [self.sample(times_s[first : first + CHUNK]) for first in range(0, max(len(times_s), 1), CHUNK)]
        position, velocity, acceleration = (np.concatenate(arrays) for arrays in zip(*chunks, strict=True))
        return position, velocity, acceleration

    def sample(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Position [m], velocity [m/s] and acceleration [m/s^2], each (n, 3), at (n,) times [s], which are clamped."""
        times = np.minimum(np.maximum(times_s, 0.0), self.duration_s)
        index = self._starts.searchsorted(times, "right") - 1
        first = int(index[0]) if times.size else 0
        one = not np.count_nonzero(index - first)  # all in one piece, as most horizons are
        powers = np.empty((4, times.size))
        t = powers[1]
        powers[0] = 1.0
        np.subtract(times, self._starts[first] if one else self._starts.take(index), out=t)
        np.multiply(t, t, out=powers[2])
        np.multiply(powers[2], t, out=powers[3])
        if one:
            motion = self._derivatives[first] @ powers
            group, same = self._group_list[first], True
        else:
            motion = (self._derivatives.take(index, axis=0) @ powers.T[:, :, None])[:, :, 0].T
            groups = self._groups.take(index)
            group = int(groups[0])
            same = not np.count_nonzero(groups - group)
        if not same:
            scaled = _scaled_harmonics(motion[9:], HARMONICS).T
            motion[:9] += (self._vectors.take(groups, axis=0) @ scaled[:, :, None])[:, :, 0].T
        elif self._harmonics[group]:
            count = self._harmonics[group]
            motion[:9] += self._vectors[group][:, : 4 * count] @ _scaled_harmonics(motion[9:], count)
        return motion[0:3].T.copy(), motion[3:6].T.copy(), motion[6:9].T.copy()

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Position [m] at one time [s], clamped, without arrays."""
        time_s = min(max(time_s, 0.0), self.duration_s)
        piece = bisect_right(self._start_list, time_s) - 1
        t = time_s - self._start_list[piece]
        x, y, z, phase = (((d * t + c) * t + b) * t + a for a, b, c, d in self._coefficients[piece])
        group = self._group_list[piece]
        if self._harmonics[group]:
            cosine, sine = math.cos(phase), math.sin(phase)
            doubled = cosine * cosine - sine * sine, 2.0 * cosine * sine
            for share, (ax, ay, az) in zip((cosine, sine, *doubled), self._amplitudes[group], strict=True):
                x, y, z = x + share * ax, y + share * ay, z + share * az
        return x, y, z


def _scaled_harmonics(phase: Array, count: int) -> Array:
    """First `count` harmonics times 1, rate, acceleration and squared rate (4 count, n), harmonic by harmonic.

    Args:
        phase: (3, n) phase, its rate and acceleration.
        count: 2 or HARMONICS.
    """
    scaled = np.empty((count, 4, phase.shape[1]))
    harmonics = scaled[:, 0]
    cosine, sine = np.cos(phase[0], out=harmonics[0]), np.sin(phase[0], out=harmonics[1])
    if count == HARMONICS:
        np.subtract(cosine * cosine, sine * sine, out=harmonics[2])
        np.multiply(2.0 * cosine, sine, out=harmonics[3])
    np.multiply(harmonics, phase[1], out=scaled[:, 1])
    np.multiply(harmonics, phase[2], out=scaled[:, 2])
    np.multiply(scaled[:, 1], phase[1], out=scaled[:, 3])
    return scaled.reshape(4 * count, -1)


def _polynomials_and_derivatives(polynomials: Array) -> Array:
    """Coefficients (n, 4, 12): position, velocity, acceleration (x, y, z each), phase, its rate and acceleration."""
    first, second = np.zeros_like(polynomials), np.zeros_like(polynomials)
    first[:, :3] = polynomials[:, 1:] * np.array((1.0, 2.0, 3.0))[:, None]
    second[:, :3] = first[:, 1:] * np.array((1.0, 2.0, 3.0))[:, None]
    orders = (polynomials, first, second)
    return np.concatenate([*(c[:, :, CUBIC] for c in orders), *(c[:, :, PHASE:] for c in orders)], axis=2)


def _vectors_and_derivatives(vectors: Array) -> Array:
    """What turns `_scaled_harmonics` into position, velocity and acceleration: (n, 9, 16), from vectors (n, 4, 3).

    With u(theta) the harmonic part of the path: u, u' theta' and u' theta'' + u'' theta'^2.
    """
    order = np.array((1.0, 1.0, 2.0, 2.0))[:, None]
    slope = order * vectors[:, (1, 0, 3, 2)] * np.array((1.0, -1.0, 1.0, -1.0))[:, None]
    result = np.zeros((len(vectors), 4, HARMONICS, 9))
    result[:, 0, :, 0:3] = vectors
    result[:, 1, :, 3:6] = slope
    result[:, 2, :, 6:9] = slope
    result[:, 3, :, 6:9] = -(order**2) * vectors
    return np.ascontiguousarray(result.transpose(0, 3, 2, 1)).reshape(-1, 9, 4 * HARMONICS)
