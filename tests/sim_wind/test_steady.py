"""Mean wind: constant and boundary layer."""

from __future__ import annotations

import math

import pytest

from uasfly.sim.wind.settings import BoundaryLayer, ConstantWind
from uasfly.sim.wind.steady import SteadyWind


def test_constant_wind_is_the_same_at_every_height() -> None:
    """A constant wind keeps all three components at every height, below the ground too."""
    wind = SteadyWind(ConstantWind(velocity_in_world_m_s=(3.0, -4.0, 0.5)))
    assert [wind.at(z) for z in (-1.0, 0.0, 100.0)] == [(3.0, -4.0, 0.5)] * 3
    assert wind.direction_in_world == pytest.approx((0.6, -0.8))
    assert wind.w20_m_s == 5.0


def test_calm_air_has_a_direction_nevertheless() -> None:
    """Calm air has zero speed and a unit vector to align nothing with."""
    wind = SteadyWind(ConstantWind(velocity_in_world_m_s=(0.0, 0.0, 0.0)))
    assert wind.w20_m_s == 0.0
    assert math.hypot(*wind.direction_in_world) == 1.0


@pytest.mark.parametrize("height_m", [0.1, 1.5, 6.096, 10.0, 30.0])
def test_boundary_layer_is_the_logarithmic_profile(height_m: float) -> None:
    """v(z) = (v*/k) ln(z/z0) with v* found from the speed at 10 m (Waslander & Wang 2009: k = 0.4, z0 = 0.05 m)."""
    friction_velocity = 0.4 * 8.0 / math.log(10.0 / 0.05)
    x, y, z = SteadyWind(BoundaryLayer(speed_at_10_m_m_s=8.0, toward_deg=30.0)).at(height_m)
    assert math.hypot(x, y) == pytest.approx(friction_velocity / 0.4 * math.log(height_m / 0.05), rel=1e-12)
    assert math.degrees(math.atan2(y, x)) == pytest.approx(30.0, abs=1e-9)
    assert z == 0.0


def test_boundary_layer_meets_its_speed_at_ten_metres() -> None:
    """At 10 m the profile has the speed that the file gives, and w20 is its speed at 20 ft."""
    wind = SteadyWind(BoundaryLayer(speed_at_10_m_m_s=8.0, toward_deg=90.0))
    assert wind.at(10.0) == pytest.approx((0.0, 8.0, 0.0), abs=1e-12)
    assert wind.w20_m_s == pytest.approx(wind.at(20 * 0.3048)[1], rel=1e-12)


def test_boundary_layer_is_calm_below_the_roughness_length() -> None:
    """The logarithm turns negative below z0; there, and under the ground, the air is at rest, without a jump."""
    wind = SteadyWind(BoundaryLayer(speed_at_10_m_m_s=8.0, toward_deg=0.0))
    assert wind.at(0.05) == wind.at(0.02) == wind.at(0.0) == wind.at(-3.0) == (0.0, 0.0, 0.0)
    assert wind.at(0.05 + 1e-9)[0] == pytest.approx(0.0, abs=1e-6)
