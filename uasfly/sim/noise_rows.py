"""White noise drawn in blocks: one row of standard normals a step, whoever reads it and however often.

What is read from a row does not change with the number of readers, so a vehicle that is asked twice answers the same.
"""

from __future__ import annotations

import numpy as np

_BLOCK_ROWS = 250


class NoiseRows:
    """Rows of standard normal numbers.

    Args:
        rng: source of the numbers.
        width: numbers a row.
    """

    def __init__(self, rng: np.random.Generator, width: int) -> None:
        self._rng = rng
        self._width = width
        self._rows: list[list[float]] = []
        self._index = 0
        self.row: list[float] = []
        self.advance()

    def advance(self) -> None:
        """Take the next row."""
        if self._index >= len(self._rows):
            self._rows = self._rng.standard_normal((_BLOCK_ROWS, self._width)).tolist()
            self._index = 0
        self.row = self._rows[self._index]
        self._index += 1
