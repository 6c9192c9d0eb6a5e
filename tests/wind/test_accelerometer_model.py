"""What the accelerometer reads in wind, and the wind from it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.wind.vehicle import GRAVITY, MODEL
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.wind.accelerometer_model import AccelerometerModel, wind_from_specific_force
from uasfly.wind.momentum import hover_inflow_m_s, thrust_ratio


def test_in_still_air_it_reads_the_thrust() -> None:
    """No air, no drag: the static thrust along body z."""
    np.testing.assert_allclose(MODEL.specific_force(np.zeros(3), 10.5), (0.0, 0.0, 10.5), atol=1e-12)


def test_each_part_is_where_the_paper_has_it() -> None:
    """Flapping and drag along the air; along the thrust the ratio of momentum theory and the drag."""
    air = np.array((3.0, -4.0, -1.0))
    speed = np.sqrt(26.0)
    inflow = hover_inflow_m_s(9.0, 0.151)
    ratio = thrust_ratio(1.0 / inflow, 5.0 / inflow).value
    expected = (3.0 * (0.24 + 0.0155 * speed), -4.0 * (0.24 + 0.0155 * speed), 9.0 * ratio - 0.0155 * speed)
    np.testing.assert_allclose(MODEL.specific_force(air, 9.0), expected, rtol=1e-9)
    np.testing.assert_allclose(MODEL.drag(air)[:2], expected[:2], rtol=1e-9)


@pytest.mark.parametrize("air", [(3.0, -4.0, 1.0), (0.0, 0.0, 2.0), (0.0, 6.0, -2.0), (1e-3, 0.0, 0.0)])
def test_the_jacobian_is_that_of_finite_differences(air: tuple[float, float, float]) -> None:
    """By all three components."""
    point, h = np.array(air), 1e-6
    columns = [
        (MODEL.specific_force(point + h * unit, 9.8) - MODEL.specific_force(point - h * unit, 9.8)) / (2 * h)
        for unit in np.eye(3)
    ]
    np.testing.assert_allclose(MODEL.with_jacobian(point, 9.8)[1], np.stack(columns, axis=1), atol=2e-4)


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (6.0, 2.0, 0.5), (-8.0, 1.0, -2.0), (0.0, 0.0, 1.5)])
def test_inversion_gives_the_wind_back(wind: tuple[float, float, float]) -> None:
    """Tilted, turned and moving, from a first guess of none."""
    rotation, velocity = rotation_matrix(quaternion_from_euler(0.2, -0.15, 2.0)), np.array((1.0, -0.5, 0.3))
    reading = MODEL.specific_force(rotation.T @ (np.array(wind) - velocity), 10.0)
    found = wind_from_specific_force(MODEL, reading, 10.0, rotation, velocity, np.zeros(3))
    np.testing.assert_allclose(found, wind, atol=1e-6)


def test_a_bias_becomes_wind_over_the_drag() -> None:
    """What made the paper fail: 0.1 m/s^2 in 6 m/s of wind is a quarter of a metre a second."""
    reading = MODEL.specific_force(np.array((6.0, 0.0, 0.0)), GRAVITY) + np.array((0.1, 0.0, 0.0))
    found = wind_from_specific_force(MODEL, reading, GRAVITY, np.eye(3), np.zeros(3), np.zeros(3))
    slope = 0.24 + 2 * 0.0155 * 6.0
    assert found[0] - 6.0 == pytest.approx(0.1 / slope, rel=0.05)


def test_the_papers_own_iteration_runs_away_where_inflow_outweighs_drag() -> None:
    """Thrust at the last wind, rest over the drag: upright it grows by inflow slope over drag each time."""

    def repeated(model: AccelerometerModel, times: int) -> float:
        reading, vertical = model.specific_force(np.array((0.0, 0.0, 0.5)), GRAVITY)[2], 0.4
        for _ in range(times):
            thrust = model.specific_force(np.array((0.0, 0.0, vertical)), GRAVITY)[2] - model.axial_1_s * vertical
            vertical = (reading - thrust) / model.axial_1_s
        return abs(vertical - 0.5)

    strong = AccelerometerModel(0.24, 1.5, 0.0, 0.151)  # more drag than the 0.63 1/s of the inflow
    weak = AccelerometerModel(0.24, 0.1, 0.0, 0.151)
    assert repeated(strong, 30) < 1e-6
    assert repeated(weak, 3) > 1.0
    found = weak.air_from_specific_force(weak.specific_force(np.array((0.0, 0.0, 0.5)), GRAVITY), GRAVITY, np.zeros(3))
    assert found[2] == pytest.approx(0.5, abs=1e-6)
