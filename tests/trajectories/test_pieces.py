"""A table of pieces samples position, velocity and acceleration of cubics and harmonics."""

from __future__ import annotations

import numpy as np

from uasfly.messages import Array
from uasfly.trajectories.pieces import Pieces, PieceTable, concatenate, rest, straight_pieces
from uasfly.trajectories.placement import Placement
from uasfly.trajectories.segments import CHUNK


def random_pieces(seed: int, count: int = 6) -> Pieces:
    """Pieces that do not fit together: what holds for them holds for any."""
    rng = np.random.default_rng(seed)
    harmonics = rng.normal(size=(count, 4, 3))
    harmonics[0] = 0.0
    harmonics[1, 2:] = 0.0
    return Pieces(rng.uniform(0.5, 2.0, count), rng.normal(size=(count, 4, 4)), harmonics)


def evaluate(pieces: Pieces, index: int, t: float) -> Array:
    """Position of a piece, written out."""
    x, y, z, phase = (np.polyval(pieces.polynomials[index, ::-1, column], t) for column in range(4))
    basis = np.array((np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)))
    return np.asarray(np.array((x, y, z)) + basis @ pieces.harmonics[index])


def test_positions_are_those_of_the_formula() -> None:
    """Cubic plus two harmonics of a cubic phase, every piece from its own start."""
    pieces = random_pieces(1)
    starts = np.concatenate(([0.0], np.cumsum(pieces.durations_s)[:-1]))
    for index, start in enumerate(starts):
        t = 0.3 * pieces.durations_s[index]
        position, _, _ = PieceTable(pieces).sample(np.array([start + t]))
        np.testing.assert_allclose(position[0], evaluate(pieces, index, t), rtol=1e-12)


def test_velocity_and_acceleration_are_the_exact_derivatives() -> None:
    """By central differences inside the pieces, straight ones and curved ones in one call."""
    pieces = random_pieces(2)
    table = PieceTable(pieces)
    middle = np.cumsum(pieces.durations_s) - 0.5 * pieces.durations_s
    h = 1e-5
    (_, velocity, acceleration), (p0, v0, _), (p1, v1, _) = (table.sample(middle + d) for d in (0.0, -h, h))
    np.testing.assert_allclose(velocity, (p1 - p0) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(acceleration, (v1 - v0) / (2 * h), atol=1e-5)


def test_times_in_any_order_and_alone_give_the_same() -> None:
    """Sampling many times at once equals sampling each: mixed legs, one leg, backwards, none."""
    table = PieceTable(random_pieces(3))
    times = np.random.default_rng(4).uniform(-1.0, table.duration_s + 1.0, 200)
    together = table.sample(times)
    alone = [table.sample(np.array([time])) for time in times]
    for kind in range(3):
        np.testing.assert_allclose(together[kind], np.concatenate([one[kind] for one in alone]), atol=1e-12)
    assert table.sample(np.empty(0))[0].shape == (0, 3)


def test_long_series_are_cut_into_chunks_without_a_seam() -> None:
    """The result is the same as that of the parts."""
    table = PieceTable(random_pieces(5))
    times = np.linspace(0.0, table.duration_s, 2 * CHUNK + 10)
    parts = [table.sample(part) for part in np.array_split(times, 7)]
    for kind, whole in enumerate(table.sample(times)):
        np.testing.assert_allclose(whole, np.concatenate([part[kind] for part in parts]), atol=1e-12)


def test_straight_pieces_join_up_to_the_acceleration() -> None:
    """Each piece starts with the state at the end of the one before."""
    jerks = np.array(((1.0, 0.0, 2.0), (0.0, 0.0, 0.0), (-1.0, 0.5, -2.0)))
    table = PieceTable(straight_pieces([0.5, 1.0, 0.5], np.array((1.0, 2.0, 3.0)), jerks))
    for joint in (0.5, 1.5):
        before, after = table.sample(np.array((joint - 1e-9,))), table.sample(np.array((joint + 1e-9,)))
        for one, other in zip(before, after, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-8)


def test_rest_stands_still_and_a_placement_moves_everything() -> None:
    """Its origin is added to every position."""
    table = PieceTable(
        concatenate([rest(np.array((1.0, 2.0, 3.0)), 1.0), rest(np.zeros(3), 0.0)]), Placement(np.full(3, 10.0))
    )
    position, velocity, acceleration = table.sample(np.array((-1.0, 0.5, 9.0)))
    np.testing.assert_array_equal(position, np.array(((11.0, 12.0, 13.0),) * 3))
    assert not velocity.any()
    assert not acceleration.any()
    assert table.duration_s == 1.0


def test_one_position_without_arrays_is_that_of_the_table() -> None:
    """At piece borders, inside, before the start and after the end; straight, once and twice harmonic pieces, moved."""
    pieces = random_pieces(8)
    table = PieceTable(pieces, Placement(np.array((1.0, -2.0, 3.0)), 0.7))
    borders = np.cumsum(pieces.durations_s)
    for time in (-1.0, 0.0, *borders, *(borders - 0.123), borders[-1] + 1.0):
        expected = table.sample(np.array([time]))[0][0]
        np.testing.assert_allclose(table.position_at(time), expected, rtol=1e-12, atol=1e-12)
