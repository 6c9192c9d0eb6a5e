"""Thrust in wind by momentum theory at constant power."""

from __future__ import annotations

import math

import pytest

from uasfly.wind.momentum import hover_inflow_m_s, thrust_ratio, thrust_ratio_in_wind

AXIAL = (-3.0, -0.8, -0.3, 0.0, 0.2, 1.0, 4.0, 20.0)
IN_PLANE = (0.0, 1e-6, 0.3, 1.0, 3.0, 30.0)


@pytest.mark.parametrize("axial", AXIAL)
@pytest.mark.parametrize("in_plane", IN_PLANE)
def test_power_and_momentum_hold_at_the_answer(axial: float, in_plane: float) -> None:
    """T lambda = 1 (power) and (lambda - a) sqrt(b^2 + lambda^2) = T (momentum), from crawling to absurd airspeeds."""
    thrust = thrust_ratio(axial, in_plane).value
    inflow = 1.0 / thrust
    assert inflow > max(axial, 0.0)
    # The test's own difference of two large numbers costs digits at large airspeeds.
    digits = 1e-12 * (1.0 + abs(axial)) * math.hypot(in_plane, inflow)
    assert (inflow - axial) * math.hypot(in_plane, inflow) == pytest.approx(thrust, rel=1e-9, abs=digits)


@pytest.mark.parametrize("inflow", [0.4, 0.9, 1.0, 1.6, 3.0])
@pytest.mark.parametrize("in_plane", [0.0, 0.7, 2.0])
def test_it_finds_an_answer_that_is_known(inflow: float, in_plane: float) -> None:
    """For any total inflow the airspeed through the disc that causes it can be written down."""
    axial = inflow - 1.0 / (inflow * math.hypot(in_plane, inflow))
    assert thrust_ratio(axial, in_plane).value == pytest.approx(1.0 / inflow, rel=1e-9)


def test_hover_has_ratio_one_and_slope_a_third() -> None:
    """In still air T = T_h; slow climb costs a third of the inflow ratio; air along the disc does nothing at first."""
    hover = thrust_ratio(0.0, 0.0)
    assert hover.value == pytest.approx(1.0, abs=1e-12)
    assert hover.by_axial == pytest.approx(-1.0 / 3.0, abs=1e-9)
    assert hover.by_in_plane == 0.0


def test_fast_climb_leaves_the_power_of_lifting() -> None:
    """Climbing fast, all power lifts: T v = P, so T/T_h goes to v_h / v."""
    assert thrust_ratio(30.0, 0.0).value * 30.0 == pytest.approx(1.0, rel=1e-4)


def test_fast_forward_flight_is_that_of_a_wing() -> None:
    """Level and fast, the induced flow is T / b: at constant power T/T_h goes to the root of b."""
    assert thrust_ratio(0.0, 400.0).value == pytest.approx(20.0, rel=1e-3)


@pytest.mark.parametrize("axial", [-1.5, -0.3, 0.0, 0.7])
@pytest.mark.parametrize("in_plane", [0.2, 1.1, 2.5])
def test_derivatives_are_finite_differences(axial: float, in_plane: float) -> None:
    """By climb and by speed along the disc."""
    h = 1e-5
    found = thrust_ratio(axial, in_plane)
    by_axial = (thrust_ratio(axial + h, in_plane).value - thrust_ratio(axial - h, in_plane).value) / (2 * h)
    by_in_plane = (thrust_ratio(axial, in_plane + h).value - thrust_ratio(axial, in_plane - h).value) / (2 * h)
    assert (found.by_axial, found.by_in_plane) == pytest.approx((by_axial, by_in_plane), abs=1e-8)


def test_angle_of_attack_is_positive_for_air_from_below() -> None:
    """At +90 deg the vehicle sinks through the air and gains thrust, at -90 deg it climbs, at 0 it flies level."""
    assert thrust_ratio_in_wind(2.0, 0.5 * math.pi, 5.0) == pytest.approx(thrust_ratio(-0.4, 0.0).value)
    assert thrust_ratio_in_wind(2.0, -0.5 * math.pi, 5.0) == pytest.approx(thrust_ratio(0.4, 0.0).value)
    assert thrust_ratio_in_wind(2.0, 0.0, 5.0) == pytest.approx(thrust_ratio(0.0, 0.4).value)


def test_voltage_acts_through_the_hover_inflow() -> None:
    """At four times the thrust the same wind counts half: v_h of 1.8 kg on 0.27 m^2 is 5.1 m/s, then 10.3."""
    low, high = (hover_inflow_m_s(thrust, 0.2714 / 1.8) for thrust in (9.80665, 4 * 9.80665))
    assert (low, high) == pytest.approx((5.15, 10.30), abs=0.01)
    assert thrust_ratio_in_wind(6.0, 0.1, high) == pytest.approx(thrust_ratio_in_wind(3.0, 0.1, low))
