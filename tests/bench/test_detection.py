"""Marker detection as the bench measures it."""

from __future__ import annotations

import pytest

from uasfly.bench.detection import DetectionBench
from uasfly.errors import UasflyError
from uasfly.vision.tracker import BundleTracker, Look


def test_every_picture_shows_the_bundle() -> None:
    """Pictures are rendered, found whole and then in the region where they are expected."""
    figures = DetectionBench(1).measure(1)
    assert 0.0 < figures.whole.median <= figures.whole.max
    assert 0.0 < figures.region.median <= figures.region.max
    assert set(figures.as_dict()) == {"whole", "region"}


def test_times_of_something_else_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the bundle is not found, nothing is reported."""
    look = BundleTracker.look

    def blind(self: BundleTracker, *arguments: object) -> Look:
        seen = look(self, *arguments)  # type: ignore[arg-type]
        return Look(None, seen.sight, (), seen.region)

    monkeypatch.setattr(BundleTracker, "look", blind)
    with pytest.raises(UasflyError, match="was not found"):
        DetectionBench(1).measure(1)
