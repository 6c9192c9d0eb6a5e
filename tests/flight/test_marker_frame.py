"""The level frame of a marker: walls, floors, and pages that lean."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.flight.marker_frame import level_frame, lies_flat
from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import Array

PLACE = np.array((5.0, -2.0, 1.6))


def page(facing_rad: float, lean_rad: float) -> Array:
    """Quaternion of a page that looks along a heading; leaning back by 90 deg it lies on its back."""
    upright = quaternion_product(
        quaternion_from_rotation_vector(np.array((0.0, 0.0, facing_rad + 0.5 * math.pi))),
        quaternion_from_rotation_vector(np.array((0.5 * math.pi, 0.0, 0.0))),
    )
    return quaternion_product(upright, quaternion_from_rotation_vector(np.array((-lean_rad, 0.0, 0.0))))


@pytest.mark.parametrize("facing", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("lean_deg", [-40.0, 0.0, 10.0, 40.0])
def test_in_front_of_a_board_is_where_its_viewer_stands(facing: float, lean_deg: float) -> None:
    """4.2 m along the horizontal direction out of the page and 0.2 m up, though the board leans."""
    quaternion = page(facing, math.radians(lean_deg))
    assert not lies_flat(quaternion)
    placement = level_frame(PLACE, quaternion, flat=False, near_rad=facing)
    assert placement.heading_rad == pytest.approx(facing)
    expected = PLACE + np.array((4.2 * math.cos(facing), 4.2 * math.sin(facing), 0.2))
    np.testing.assert_allclose(placement.to_world(np.array((4.2, 0.0, 0.2))), expected, atol=1e-9)


@pytest.mark.parametrize("lean_deg", [90.0, 60.0, 110.0, -90.0])
def test_on_the_floor_x_is_where_the_pages_upper_edge_points(lean_deg: float) -> None:
    """A page that looked north and was laid on its back has its upper edge in the south; face down it is the north."""
    quaternion = page(0.5 * math.pi, math.radians(lean_deg))
    assert lies_flat(quaternion)
    heading = level_frame(PLACE, quaternion, flat=True, near_rad=0.0).heading_rad
    assert abs(heading) == pytest.approx(0.5 * math.pi)
    assert (heading < 0.0) == (lean_deg > 0.0)


def test_a_heading_is_the_one_nearest_to_that_in_use() -> None:
    """Across the seam at 180 deg the mission does not turn round."""
    for heading in (3.13, -3.13):
        found = level_frame(PLACE, page(heading, 0.0), flat=False, near_rad=3.1).heading_rad
        assert abs(found - 3.1) < 0.1
