"""Sensor and link sections, and the virtual GNSS of eq. 11."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.files import find_file, load_file
from uasfly.sim.scenario import Gnss, Scenario, Sensors


def test_gnss_error_over_seeds_has_the_expected_rms() -> None:
    """Eq. 11 run at 10 Hz over 2000 seeds of two minutes meets `expected_rms_m` within 3 %."""
    gnss = Gnss(white_sigma_m=0.3, random_walk_m_sqrt_s=0.1, initial_bias_m=(0.5, -0.2, 0.1))
    rng = np.random.default_rng(1)
    square = []
    for _ in range(2000):
        steps = rng.normal(0.0, gnss.random_walk_m_sqrt_s * math.sqrt(0.1), (1200, 3))
        error = np.array(gnss.initial_bias_m) + np.cumsum(steps, axis=0) + rng.normal(0.0, 0.3, (1200, 3))
        square.append((error**2).sum(axis=1).mean())
    assert math.sqrt(float(np.mean(square))) == pytest.approx(gnss.expected_rms_m(120.0), rel=0.03)


def test_gnss_error_that_begins_later_by_hand() -> None:
    """Walking for the second minute of two: 3 * 0.1^2 * 60^2 / (2 * 120) = 0.45 m^2; before it begins, nothing."""
    gnss = Gnss(white_sigma_m=0.0, random_walk_m_sqrt_s=0.1, walk_from_s=60.0)
    assert gnss.expected_rms_m(120.0) == pytest.approx(math.sqrt(0.45))
    assert gnss.expected_rms_m(60.0) == 0.0


def test_gnss_degraded_is_scaled_to_the_papers_error() -> None:
    """The shipped scenario expects 1.28 m RMS over 137 s in offboard, with eq. 11's white noise of 1e-3 m^2."""
    sensors = load_file(find_file("scenario", "gnss_degraded"), Scenario).sensors
    assert sensors.gnss is not None
    assert sensors.gnss.expected_rms_m(137.0) == pytest.approx(1.28, abs=0.005)
    assert sensors.gnss.white_sigma_m**2 == pytest.approx(1e-3, rel=0.01)


def test_white_noise_of_a_position_is_that_of_its_source() -> None:
    """position_white_sigma_m is position_noise_m with motion capture and gnss.white_sigma_m with GNSS."""
    mocap = Sensors(position="mocap", position_noise_m=0.01)
    gnss = Sensors(position="gnss", gnss=Gnss(white_sigma_m=0.4, random_walk_m_sqrt_s=0.1))
    assert (mocap.position_white_sigma_m, gnss.position_white_sigma_m) == (0.01, 0.4)


def test_a_scenario_of_a_name_alone_is_calm_with_motion_capture() -> None:
    """Everything but the name has a default: still air, 1 cm position noise, no delay."""
    scenario = Scenario(name="mine")
    assert scenario.wind.jets == ()
    assert scenario.wind.mean.w20_m_s == 0.0
    assert scenario.sensors.position_white_sigma_m == 0.01
    assert scenario.link.telemetry_latency_s == scenario.link.command_latency_s == 0.0
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario
