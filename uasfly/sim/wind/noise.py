"""White noise drawn in blocks, because one draw from a numpy generator costs more than a whole step of the wind."""

from __future__ import annotations

import numpy as np

_BLOCK = 1024


class NormalTriples:
    """Endless triples of independent standard normal floats.

    Args:
        rng: where they come from; it is asked for 3 * 1024 numbers at a time.
    """

    __slots__ = ("_next", "_rng", "_rows")

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._rows: list[list[float]] = []
        self._next = 0

    def draw(self) -> list[float]:
        """The next three numbers."""
        if self._next == len(self._rows):
            self._rows = self._rng.standard_normal((_BLOCK, 3)).tolist()
            self._next = 0
        row = self._rows[self._next]
        self._next += 1
        return row
