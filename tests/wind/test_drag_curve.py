"""Drag and airspeed, both ways."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.files import find_file, load_file
from uasfly.wind.drag_curve import UNKNOWN_DRAG_SHARE, DragCurve, wind_settings

curves = st.builds(DragCurve, st.floats(0.01, 2.0), st.floats(0.0, 0.1))
airspeeds = st.floats(0.0, 40.0)


@given(curve=curves, airspeed=airspeeds)
def test_the_airspeed_of_a_drag_is_the_one_it_came_from(curve: DragCurve, airspeed: float) -> None:
    """Both directions are each other's inverse, also without a quadratic part."""
    assert curve.airspeed(curve.force(airspeed)) == pytest.approx(airspeed, rel=1e-9, abs=1e-12)


@given(curve=curves, airspeed=airspeeds, faster=st.floats(0.01, 5.0))
def test_more_air_pushes_more(curve: DragCurve, airspeed: float, faster: float) -> None:
    """The curve rises everywhere, at least as the linear part does."""
    assert curve.force(airspeed + faster) - curve.force(airspeed) >= 0.999 * curve.drag_1_s * faster


@given(curve=curves, airspeed=st.floats(0.1, 40.0))
def test_slope_and_ratio_are_what_small_changes_do(curve: DragCurve, airspeed: float) -> None:
    """Along the airspeed the slope, across it the ratio, against finite differences."""
    step = 1e-5
    along = (curve.force(airspeed + step) - curve.force(airspeed - step)) / (2.0 * step)
    assert curve.slope(airspeed) == pytest.approx(along, rel=1e-5)
    turned = math.hypot(airspeed, step)  # a small component across leaves the size as it is
    across = curve.force(turned) * (step / turned) / step
    assert curve.ratio(airspeed) == pytest.approx(across, rel=1e-5)


def test_rotors_that_carry_more_drag_more() -> None:
    """The linear part grows with the root of the thrust, the body's does not; free fall divides by nothing."""
    curve = DragCurve(0.2, 0.01)
    assert curve.under_thrust(GRAVITY_M_S2) == curve
    assert curve.under_thrust(4.0 * GRAVITY_M_S2) == DragCurve(pytest.approx(0.4), 0.01)  # type: ignore[arg-type]
    assert curve.under_thrust(-1.0).drag_1_s > 0.0


def test_without_an_identified_drag_the_models_is_taken_with_a_large_sigma() -> None:
    """And no wind is told by a vehicle that feels none."""
    airframe = load_file(find_file("airframe", "iris"), Airframe)
    assumed = wind_settings(airframe)
    assert assumed is not None
    assert (assumed.drag_1_s, assumed.drag_1_m) == (airframe.model.drag_1_s[0], 0.0)
    assert assumed.drag_sigma_share == UNKNOWN_DRAG_SHARE
    slippery = airframe.model.model_copy(update={"drag_1_s": (0.0, 0.0, 0.0)})
    assert wind_settings(airframe.model_copy(update={"model": slippery})) is None
