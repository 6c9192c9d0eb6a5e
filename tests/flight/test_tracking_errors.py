"""Errors that are compared some at a time: the same as all at once, whatever comes late, out of order or unusable."""

from __future__ import annotations

import numpy as np
import pytest

from uasfly.flight.tracking_errors import EVERY_CYCLES, MOST, MarkerDatum, TrackingErrors
from uasfly.messages import Array, OdometrySample, TruthSample

ZERO, LEVEL = np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0))
DATUM = MarkerDatum(np.array((5.0, 0.2, 1.5)), np.array((4.0, 0.0, 1.4)), 0.3)


def _truth(time_s: float, position: Array) -> TruthSample:
    return TruthSample(time_s, position, ZERO, LEVEL, ZERO, ZERO)


def _at(asked: Array, times: Array, rows: Array) -> Array:
    return np.column_stack([np.interp(asked, times, axis) for axis in rows.T])


def _rms(errors: Array) -> dict[str, float]:
    x, y, z = np.sqrt((errors**2).mean(axis=0)).tolist()
    return {"x": x, "y": y, "z": z, "total": float(np.sqrt((errors**2).sum(axis=1).mean()))}


@pytest.mark.parametrize("late", [0, 3, 2 * EVERY_CYCLES + 5])
def test_pieces_give_what_the_whole_gives(late: int) -> None:
    """Random estimates over many comparisons, truth and GNSS late and in pairs out of order: each counts once."""
    rng = np.random.default_rng(late)
    count = 10 * EVERY_CYCLES + 7
    times: Array = 0.02 * np.arange(count, dtype=float)
    estimate, reference = rng.standard_normal((2, count, 3))
    asked: Array = times[:-1] + 0.013
    true = asked[:, None] * np.array((3.0, -2.0, 1.0))  # a line: what lies around a time does not matter on it
    fixes = rng.standard_normal((count - 1, 3))
    errors = TrackingErrors()
    order = np.arange(count - 1).reshape(-1, 2)[:, ::-1].ravel()
    for k in range(count + late):
        if 0 <= k - late - 1 < count - 1:
            n = int(order[k - late - 1])
            errors.hear(_truth(float(asked[n]), true[n]))
            errors.hear(OdometrySample(float(asked[n]) + 0.002, fixes[n], ZERO, LEVEL, ZERO))
        if k < count:
            errors.cycle(float(times[k]), estimate[k], reference[k], DATUM)
    errors.compare()
    errors.compare()  # nothing is left
    assert errors.against_estimate.rms() == pytest.approx(_rms(estimate - reference))
    inside = asked <= times[-1]
    assert errors.against_truth.count == errors.estimate.count == inside.sum()
    assert errors.against_truth.rms() == pytest.approx(_rms(true - _at(asked, times, reference)))
    assert errors.estimate.rms() == pytest.approx(_rms(_at(asked, times, estimate) - true))
    seen = asked + 0.002 <= asked[-1]
    assert errors.gnss.rms() == pytest.approx(_rms(fixes[seen] - _at(asked[seen] + 0.002, asked, true)))
    placed = np.array([DATUM.placed(position) for position in true])
    assert errors.by_marker.rms() == pytest.approx(_rms(placed - _at(asked, times, reference)))
    assert errors.by_marker.largest == pytest.approx(
        np.linalg.norm(placed - _at(asked, times, reference), axis=1).max()
    )


def test_a_datum_is_the_true_place_seen_from_the_marker() -> None:
    """A vehicle 2 m before the true marker lies 2 m before the estimated one, turned with it; by hand."""
    quarter = MarkerDatum(np.array((10.0, 0.0, 1.0)), np.array((4.0, 0.0, 1.5)), np.pi / 2)
    assert quarter.placed(np.array((2.0, 0.0, 1.7))) == pytest.approx([10.0, -2.0, 1.2])


def test_what_is_not_finite_says_nothing() -> None:
    """One NaN from GNSS and one of the estimate leave the figures of the rest."""
    errors = TrackingErrors()
    for k in range(100):
        offset = np.full(3, np.nan if k == 40 else 0.1)
        errors.hear(_truth(0.02 * k, ZERO))
        errors.hear(OdometrySample(0.02 * k, offset, ZERO, LEVEL, ZERO))
        errors.cycle(0.02 * k, np.full(3, np.nan if k == 60 else 0.2), ZERO, None)
    errors.compare()
    assert errors.gnss.rms() == pytest.approx({"x": 0.1, "y": 0.1, "z": 0.1, "total": 0.1 * 3**0.5})
    assert errors.estimate.rms() == pytest.approx({"x": 0.2, "y": 0.2, "z": 0.2, "total": 0.2 * 3**0.5})
    assert errors.against_estimate.count == 99


def test_nothing_piles_up_where_nothing_can_be_compared() -> None:
    """An hour on the ground, and an hour of legs without truth, keep no more than some seconds of samples."""
    ground, real = TrackingErrors(), TrackingErrors()
    for k in range(20 * MOST):
        ground.hear(_truth(0.02 * k, ZERO))
        ground.hear(OdometrySample(0.02 * k, ZERO, ZERO, LEVEL, ZERO))
        real.hear(OdometrySample(0.02 * k, ZERO, ZERO, LEVEL, ZERO))
        real.cycle(0.02 * k, ZERO, ZERO, None)
        assert len(ground._truths) + len(ground._new_fixes) <= MOST
        assert len(real._cycles) + len(real._new_fixes) <= MOST
    assert ground.gnss.rms() is None
    assert real.against_estimate.count == 20 * MOST // EVERY_CYCLES * EVERY_CYCLES
