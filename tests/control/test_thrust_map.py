"""Thrust against battery voltage."""

from __future__ import annotations

import math

import pytest

from uasfly.airframe import Airframe
from uasfly.control.thrust_map import LARGEST_SCALE, SMALLEST_SCALE, ThrustMap

K = 28.54209


def test_at_the_reference_voltage_the_file_holds(airframe: Airframe) -> None:
    """Before any voltage, and at the reference voltage, k_thrust is the file's."""
    thrust_map = ThrustMap(airframe)
    assert thrust_map.k_thrust_m_s2() == pytest.approx(K)
    assert thrust_map.update(0.0, None) == pytest.approx(K)
    assert thrust_map.update(0.0, 14.8) == pytest.approx(K)


def test_the_first_voltage_counts_at_once_and_later_ones_over_a_second(airframe: Airframe) -> None:
    """A step of the voltage has 63 % of its effect after a second."""
    thrust_map = ThrustMap(airframe)
    assert thrust_map.update(0.0, 14.8 * 0.9) == pytest.approx(K * 0.81)
    for step in range(1, 51):
        scale = thrust_map.update(step * 0.02, 14.8) / K
    filtered = 0.9 + 0.1 * (1.0 - math.exp(-1.0))
    assert scale == pytest.approx(filtered**2)


def test_nonsense_leaves_everything_as_it_was(airframe: Airframe) -> None:
    """Missing, zero, negative and NaN voltages change nothing, and time without a voltage does not jump the filter."""
    thrust_map = ThrustMap(airframe)
    before = thrust_map.update(0.0, 14.0)
    for voltage in (None, 0.0, -3.0, math.nan, math.inf):
        assert thrust_map.update(1.0, voltage) == before


def test_the_scale_is_bounded(airframe: Airframe) -> None:
    """A wrong reference voltage cannot turn the thrust upside down."""
    assert ThrustMap(airframe).update(0.0, 5.0) == pytest.approx(K * SMALLEST_SCALE)
    assert ThrustMap(airframe).update(0.0, 50.0) == pytest.approx(K * LARGEST_SCALE)


def test_before_the_controller_flies_a_voltage_can_be_asked_about(airframe: Airframe) -> None:
    """The observer runs before take-over: an unfiltered answer then, the filtered one later."""
    thrust_map = ThrustMap(airframe)
    assert thrust_map.k_thrust_m_s2(14.8 * 0.9) == pytest.approx(K * 0.81)
    thrust_map.update(0.0, 14.8)
    assert thrust_map.k_thrust_m_s2(14.8 * 0.9) == pytest.approx(K)
