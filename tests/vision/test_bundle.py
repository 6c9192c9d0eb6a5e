"""Bundles: corners in the bundle's frame, and what a file may say."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from uasfly.bundle import Bundle
from uasfly.files import find_file, load_file, shipped_names


def test_corners_run_from_top_left_clockwise_seen_from_the_front() -> None:
    """X right, y up, z towards the viewer."""
    bundle = load_file(find_file("bundle", "four_36h11"), Bundle)
    expected = ((0.1, 0.3, 0.0), (0.3, 0.3, 0.0), (0.3, 0.1, 0.0), (0.1, 0.1, 0.0))
    np.testing.assert_allclose(bundle.corners(1), expected)
    assert bundle.marker_id == 0


def test_a_marker_may_be_turned_in_its_bundle() -> None:
    """A quarter turn counter-clockwise takes the top-left corner to the bottom left."""
    marker = {"id": 5, "size_m": 0.2, "position_m": (1.0, 0.0, 0.0), "rpy_deg": (0.0, 0.0, 90.0)}
    bundle = Bundle.model_validate({"name": "turned", "family": "36h11", "markers": [marker], "number": 9})
    np.testing.assert_allclose(bundle.corners(5)[0], (0.9, -0.1, 0.0), atol=1e-12)
    assert bundle.marker_id == 9


def test_an_id_stands_once_in_a_bundle() -> None:
    """Two markers with one id cannot be told apart."""
    markers = [{"id": 5, "size_m": 0.2}, {"id": 5, "size_m": 0.1}]
    with pytest.raises(ValidationError, match="id 5 2 times"):
        Bundle.model_validate({"name": "double", "family": "36h11", "markers": markers})


def test_bundles_are_shipped() -> None:
    """By these names."""
    assert shipped_names("bundle") == ["floor_36h11", "four_36h11", "single_36h11"]
