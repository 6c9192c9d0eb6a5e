"""Intervals against known figures, groups, labels and the order of the worst."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from uasfly.campaign.statistics import bootstrap_median, label, student, summarise, wilson, worst


@pytest.mark.parametrize(
    ("successes", "count", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662)],
)
def test_wilson(successes: int, count: int, low: float, high: float) -> None:
    """Newcombe 1998, table I (81 of 263 without continuity correction), and the ends."""
    assert wilson(successes, count) == pytest.approx((low, high), abs=5e-5)


def test_student() -> None:
    """Four values by hand: t(0.975, 3) = 3.1824, sigma = 1.29099."""
    assert student([1.0, 2.0, 3.0, 4.0]) == pytest.approx((2.5 - 2.05426, 2.5 + 2.05426), abs=1e-4)
    assert student([1.0]) is None


def test_the_bootstrap_covers_the_median_and_is_always_the_same() -> None:
    """Of 200 samples of 40 about 95 % hold the true median."""
    generator = np.random.default_rng(1)
    held = 0
    for _ in range(200):
        interval = bootstrap_median(generator.normal(3.0, 1.0, 40).tolist())
        assert interval is not None
        held += interval[0] <= 3.0 <= interval[1]
    assert 180 <= held <= 199
    assert bootstrap_median([1.0, 2.0, 4.0]) == bootstrap_median([1.0, 2.0, 4.0])
    assert bootstrap_median([2.0] * 5) == (2.0, 2.0)
    assert bootstrap_median([2.0]) is None


def _row(index: int, controller: str, outcome: str, rms: float | None, **more: Any) -> dict[str, Any]:
    row = {"index": index, "airframe": "f550", "mission": "hover", "scenario": "gusty", "controller": controller}
    return {**row, "outcome": outcome, "tracking_rms_m": rms, "success": outcome == "completed", **more}


def test_groups_count_and_measure() -> None:
    """RMS of completed flights only; rates of all."""
    rows = [
        _row(0, "nmpc", "completed", 0.02),
        _row(1, "nmpc", "completed", 0.04),
        _row(2, "nmpc", "aborted", 0.5),
        _row(3, "pid", "error", None),
    ]
    first, second = summarise(rows, [])
    assert (first.flights, first.successes, first.completed, first.errors) == (3, 2, 2, 0)
    assert (first.rms_median_m, first.rms_mean_m, first.rms_worst_m) == pytest.approx((0.03, 0.03, 0.04))
    assert (second.success_rate, second.errors, second.rms_median_m, second.rms_mean_interval_m) == (0.0, 1, None, None)
    assert [row["index"] for row in worst(rows, 3)] == [3, 2, 1]


def test_labels_say_what_differs() -> None:
    """And the whole name of a swept field where its end is not enough."""
    base = {"airframe": "f550", "mission": "hover", "scenario": "gusty", "controller": "nmpc"}
    one, two = {**base, "plant.mass_kg": 1.0}, {**base, "plant.mass_kg": 2.0}
    assert label(one, [one]) == "f550, hover, gusty, nmpc"
    assert label(two, [one, two]) == "mass_kg=2.0"
    one, two = ({**base, "airframe.mass_kg": 1.0, "plant.mass_kg": mass} for mass in (1.0, 2.0))
    assert label(two, [one, two]) == "plant.mass_kg=2.0"
