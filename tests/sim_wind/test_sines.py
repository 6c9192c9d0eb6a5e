"""Gusts as a sum of sines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.files import find_file, load_file, parse_overrides
from uasfly.sim.scenario import Scenario
from uasfly.sim.wind import WindField, WindSettings
from uasfly.sim.wind.dryden import low_altitude_parameters
from uasfly.sim.wind.settings import BoundaryLayer
from uasfly.sim.wind.sines import SINES, SumOfSines, horizontal_density, vertical_density

BREEZE = BoundaryLayer(speed_at_10_m_m_s=8.0, toward_deg=30.0)
SINUOUS = WindSettings(mean=BREEZE, gusts="sum_of_sines")


def test_densities_are_those_of_the_specification() -> None:
    """Over all frequencies both integrate to sigma squared; at Omega = 1/L they are sigma^2 L/pi, both."""
    omega = np.logspace(-5, 5, 400_000)
    for density in (horizontal_density, vertical_density):
        assert np.trapezoid(density(omega, 1.5, 8.0), omega) == pytest.approx(2.25, rel=1e-3)
        assert density(np.array(1.0 / 8.0), 1.5, 8.0) == pytest.approx(2.25 * 8.0 / math.pi, rel=1e-12)


def test_its_spectrum_is_half_the_density_in_each_part_of_the_band() -> None:
    """Power a^2/2 of the sines in four parts of the band, over 400 seeds, against half the integral of the density."""
    height_m, w20_m_s = 2.0, 7.7
    figures = low_altitude_parameters(height_m, w20_m_s)
    edges = np.linspace(0.1, 1.5, 5)
    power = np.zeros((3, 4))
    seeds = 400
    for seed in range(seeds):
        gusts = SumOfSines(w20_m_s, np.random.default_rng(seed), 0.004)
        for axis in range(3):
            squares = 0.5 * gusts.amplitudes_m_s(height_m)[axis] ** 2
            power[axis] += np.histogram(gusts.omega_rad_s[axis], edges, weights=squares)[0] / seeds
    for part in range(4):
        omega = np.linspace(edges[part], edges[part + 1], 2001)
        horizontal = 0.5 * np.trapezoid(horizontal_density(omega, figures.sigma_u_m_s, figures.length_u_m), omega)
        vertical = 0.5 * np.trapezoid(vertical_density(omega, figures.sigma_w_m_s, figures.length_w_m), omega)
        assert power[:, part] == pytest.approx((horizontal, horizontal, vertical), rel=0.03)


def test_what_it_leaves_of_the_sigmas_is_what_its_text_says() -> None:
    """Flown for long at 2 m: 0.41 of sigma_h on both horizontal axes, 0.56 of sigma_v upright."""
    figures = low_altitude_parameters(2.0, 7.7)
    variance = np.zeros(3)
    for seed in range(20):
        gusts = SumOfSines(7.7, np.random.default_rng(seed), 0.1)
        variance += np.array([gusts.step(2.0, 5.0) for _ in range(4000)]).var(axis=0) / 20
    share = np.sqrt(variance) / (figures.sigma_u_m_s, figures.sigma_u_m_s, figures.sigma_w_m_s)
    assert share == pytest.approx((0.41, 0.41, 0.56), abs=0.02)


def test_every_part_of_the_band_has_one_sine() -> None:
    """Frequencies are random and none leaves its part."""
    gusts = SumOfSines(8.0, np.random.default_rng(1), 0.004)
    parts = np.floor((gusts.omega_rad_s - 0.1) / (1.4 / SINES))
    assert (parts == np.arange(SINES)).all()
    assert not np.array_equal(gusts.omega_rad_s, SumOfSines(8.0, np.random.default_rng(2), 0.004).omega_rad_s)


def test_the_field_adds_it_to_the_mean_along_the_wind() -> None:
    """v0 + sum: u along the mean wind, v to its left, w up; nothing is drawn after the beginning."""
    rng, other = np.random.default_rng(3), np.random.default_rng(3)
    field = WindField(SINUOUS, rng, 0.004)
    w20 = 8.0 * math.log(6.096 / 0.05) / math.log(200.0)
    gusts = SumOfSines(w20, other, 0.004)
    mean = 8.0 * math.log(2.0 / 0.05) / math.log(200.0)
    along, left = np.array((math.cos(math.pi / 6), 0.5)), np.array((-0.5, math.cos(math.pi / 6)))
    for _ in range(100):
        u, v, w = gusts.step(2.0, 5.0)
        expected = (*((mean + u) * along + v * left).tolist(), w)
        assert field.step((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), None).free_in_world == pytest.approx(expected, abs=1e-12)
    assert rng.standard_normal() == other.standard_normal()


def test_climbing_makes_no_jump() -> None:
    """From 2 m to 10 m within 8 s the gust changes by no more than the steepest sines allow."""
    gusts = SumOfSines(8.0, np.random.default_rng(4), 0.004)
    record = np.array([gusts.step(2.0 + 0.004 * index, 5.0) for index in range(2000)])
    assert np.abs(np.diff(record, axis=0)).max() < 0.05


def test_a_scenario_file_can_ask_for_it() -> None:
    """By --set in a shipped scenario, and back from what the log keeps."""
    changed = load_file(find_file("scenario", "gusty"), Scenario, parse_overrides(["wind.gusts=sum_of_sines"]))
    assert changed.wind.gusts == "sum_of_sines"
    assert Scenario.model_validate_json(changed.model_dump_json()) == changed
    assert WindSettings.model_validate(SINUOUS.model_dump()) == SINUOUS


def test_the_boundary_layer_ends_where_the_paper_says() -> None:
    """By hand: v* = 0.4 * 8 / ln 200 = 0.6040 m/s; 0.02 * 0.6040 / (2 * 7.2921e-5 * sin 45 deg) = 117.1 m."""
    assert BREEZE.top_m(45.0) == pytest.approx(117.1, abs=0.1)
    assert BREEZE.top_m(-45.0) == BREEZE.top_m(45.0)
