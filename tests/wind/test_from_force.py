"""Wind from force, and how well it is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from uasfly.airframe import GRAVITY_M_S2
from uasfly.messages import Array
from uasfly.wind.drag_curve import DragCurve
from uasfly.wind.from_force import Uncertainty, air_relative, wind_covariance

CURVE = DragCurve(0.2, 0.016)
NONE = Uncertainty(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
part = st.floats(-15.0, 15.0)
slope_part = st.floats(-0.5, 0.5)


@given(east=part, north=part, slope=st.tuples(slope_part, slope_part), climb=st.floats(-2.0, 2.0))
def test_the_air_comes_back_from_the_force_it_made(
    east: float, north: float, slope: tuple[float, float], climb: float
) -> None:
    """Tilted and climbing; the fixed point leaves a millimetre a second at most."""
    size = math.sqrt(east**2 + north**2 + climb**2)
    ratio = CURVE.ratio(size)
    force = (ratio * (east + slope[0] * climb), ratio * (north + slope[1] * climb))
    air, speed = air_relative(force, slope, climb, CURVE)
    assert air == pytest.approx((east, north), abs=1e-3)
    assert speed == pytest.approx(size, abs=1e-3)


def jacobian(force: tuple[float, float], slope: tuple[float, float]) -> Array:
    """Derivative of the air's velocity with respect to the force, by differences."""
    step = 1e-5
    columns = []
    for shift in ((step, 0.0), (0.0, step)):
        more, _ = air_relative((force[0] + shift[0], force[1] + shift[1]), slope, 0.0, CURVE)
        less, _ = air_relative((force[0] - shift[0], force[1] - shift[1]), slope, 0.0, CURVE)
        columns.append((np.array(more) - np.array(less)) / (2.0 * step))
    return np.column_stack(columns)


@pytest.mark.parametrize("force", [(1.2, -0.7), (0.05, 0.0), (0.0, 4.0)])
def test_the_covariance_is_what_small_errors_make(force: tuple[float, float]) -> None:
    """Force, tilt and drag each alone, through finite differences; velocity and vertical wind as they come."""
    slope = (0.1, -0.2)
    _, speed = air_relative(force, slope, 0.0, CURVE)
    by_force = jacobian(force, slope)
    spread = by_force @ by_force.T
    alone = wind_covariance(force, slope, speed, CURVE, replace(NONE, force_m_s2=0.03))
    np.testing.assert_allclose(alone, 0.03**2 * spread, rtol=1e-5, atol=1e-12)
    alone = wind_covariance(force, slope, speed, CURVE, replace(NONE, tilt_rad=0.004))
    np.testing.assert_allclose(alone, (0.004 * GRAVITY_M_S2) ** 2 * spread, rtol=1e-5, atol=1e-12)
    shift = 1e-5
    stronger = DragCurve(CURVE.drag_1_s * (1.0 + shift), CURVE.drag_1_m * (1.0 + shift))
    by_share = (
        np.array(air_relative(force, slope, 0.0, stronger)[0]) - air_relative(force, slope, 0.0, CURVE)[0]
    ) / shift
    alone = wind_covariance(force, slope, speed, CURVE, replace(NONE, drag_share=0.05))
    np.testing.assert_allclose(alone, 0.05**2 * np.outer(by_share, by_share), rtol=1e-3, atol=1e-9)
    alone = wind_covariance(force, slope, speed, CURVE, replace(NONE, velocity_m_s=0.1, vertical_m_s=0.5))
    np.testing.assert_allclose(alone, 0.01 * np.eye(2) + 0.25 * np.outer(slope, slope), atol=1e-12)


def test_without_any_force_the_wind_is_as_uncertain_in_all_directions() -> None:
    """Calm has no direction to divide by."""
    covariance = wind_covariance((0.0, 0.0), (0.0, 0.0), 0.0, CURVE, replace(NONE, tilt_rad=0.003, drag_share=0.1))
    np.testing.assert_allclose(covariance, (0.003 * GRAVITY_M_S2 / CURVE.drag_1_s) ** 2 * np.eye(2))
