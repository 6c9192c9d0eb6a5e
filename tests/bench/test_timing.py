"""Statistics of times."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from uasfly.bench.timing import Figures, Ratios, as_in_flight


def test_median_p99_and_max_of_known_samples() -> None:
    """Of 0..100 the median is 50, the 99th percentile 99, the largest 100."""
    figures = Figures.of(np.random.default_rng(0).permutation(101).astype(float))
    assert figures == Figures(50.0, 99.0, 100.0)


def test_no_samples_have_no_figures() -> None:
    """Nothing measured is told as nothing, not as NaN."""
    assert Figures.of([]) is None
    assert Ratios.of([], []) is None


def test_ratio_of_medians_is_paired_by_block() -> None:
    """A computer that is twice as slow during a block changes both sides of that block, and no ratio."""
    anchor = np.linspace(1.0, 2.0, 101)
    ratios = Ratios.of([0.1 * anchor, 0.2 * anchor, 0.1 * anchor], [anchor, 2.0 * anchor, anchor])
    assert ratios is not None
    assert ratios.median == pytest.approx(0.1)
    assert ratios.p99 == pytest.approx(0.1)


def test_blocks_without_a_partner_do_not_count() -> None:
    """What was measured alone enters neither percentile."""
    ones = np.ones(10)
    ratios = Ratios.of([0.5 * ones], [ones, 100.0 * ones])
    assert ratios == Ratios(0.5, 0.5)


def test_garbage_collection_is_left_on_as_in_flight() -> None:
    """What lived before is set aside; collection goes on."""
    with as_in_flight():
        assert gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert gc.get_freeze_count() == 0
