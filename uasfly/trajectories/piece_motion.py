"""The motion of a piece as one generated function, and its evaluation at many times without copies."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from uasfly import native

COLUMNS = 4  # of a polynomial: x, y, z [m] and phase [rad]
HARMONICS = 4  # cos, sin, cos of twice, sin of twice the phase
PIECE = 4 * COLUMNS + 3 * HARMONICS  # numbers of a piece: coefficients of t^0..t^3, then vectors of the harmonics


@lru_cache(maxsize=1)
def piece_motion() -> ca.Function:
    """(time since the piece's start [s], piece (PIECE,)) -> position [m], velocity [m/s], acceleration [m/s^2]."""
    t, piece = ca.SX.sym("t"), ca.SX.sym("piece", PIECE)
    polynomials = ca.reshape(piece[: 4 * COLUMNS], COLUMNS, 4)
    vectors = ca.reshape(piece[4 * COLUMNS :], 3, HARMONICS)
    *cubic, phase = ca.vertsplit(ca.mtimes(polynomials, ca.vertcat(1.0, t, t**2, t**3)))
    cosine, sine = ca.cos(phase), ca.sin(phase)
    harmonics = ca.vertcat(cosine, sine, cosine * cosine - sine * sine, 2.0 * cosine * sine)
    position = ca.vertcat(*cubic) + ca.mtimes(vectors, harmonics)
    velocity = ca.jacobian(position, t)
    acceleration = ca.jacobian(velocity, t)
    motion = [ca.densify(vector) for vector in (position, velocity, acceleration)]
    function = ca.Function("uasfly_piece_motion", [t, piece], motion, {"cse": True})
    return native.compiled([function], "piece_motion")[0]


class MotionSampler:
    """`piece_motion` on memory that stays: fill `times_s` and `pieces`, call `evaluate`, read the rest; for one thread.

    Attributes:
        times_s: (n,) since the start of each time's piece.
        pieces: (n, PIECE), the piece of each time.
        position, velocity, acceleration: (n, 3) [m, m/s, m/s^2].
        evaluate: does it.
    """

    def __init__(self, count: int) -> None:
        self.times_s, self.pieces = np.empty(count), np.empty((count, PIECE))
        self.position, self.velocity, self.acceleration = (np.empty((count, 3)) for _ in range(3))
        self._buffer: Any
        self._buffer, self.evaluate = piece_motion().map(count).buffer()
        for index, argument in enumerate((self.times_s, self.pieces)):
            self._buffer.set_arg(index, argument.data)
        for index, result in enumerate((self.position, self.velocity, self.acceleration)):
            self._buffer.set_res(index, result.data)
