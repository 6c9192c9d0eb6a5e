"""White noise in blocks."""

from __future__ import annotations

import numpy as np

from uasfly.sim.wind.noise import NormalTriples


def test_triples_are_the_generators_numbers_in_order() -> None:
    """Across block boundaries the triples are the generator's own normal sequence, none left out, none twice."""
    noise = NormalTriples(np.random.default_rng(9))
    drawn = [list(noise.draw()) for _ in range(3000)]
    assert drawn == np.random.default_rng(9).standard_normal((3000, 3)).tolist()


def test_triples_are_plain_floats() -> None:
    """Numpy scalars would slow every step that touches them."""
    assert {type(value) for value in NormalTriples(np.random.default_rng(9)).draw()} == {float}
