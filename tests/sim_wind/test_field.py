"""The wind field as the plant steps it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.messages import Array
from uasfly.sim.wind import WindField, WindSettings
from uasfly.sim.wind.dryden import DrydenGusts, low_altitude_parameters
from uasfly.sim.wind.settings import BoundaryLayer, ConstantWind, JetSchedule, JetSettings, RadialGaussian

Place = tuple[float, float, float]

STEP_S = 0.004
REST = (0.0, 0.0, 0.0)
AIM = (0.0, 0.0, 1.5)


def blower(azimuth_deg: float, intensity: float = 0.15) -> JetSettings:
    """A jet of 10 m/s at (0, 0, 1.5)."""
    return JetSettings.model_validate(
        {
            "name": "blower",
            "aim_m": AIM,
            "distance_m": 1.0,
            "azimuth_deg": azimuth_deg,
            "axis_speed": ((1.0, 10.0),),
            "radial": RadialGaussian(half_width_at_nozzle_m=0.2).model_dump(),
            "turbulence": {"intensity": intensity},
            "schedule": JetSchedule(start_s=0.5, edge_s=0.0).model_dump(),
        }
    )


BREEZE = BoundaryLayer(speed_at_10_m_m_s=8.0, toward_deg=30.0)
EVERYTHING = WindSettings(mean=BREEZE, gusts="dryden", jets=(blower(0.0), blower(90.0)))


def fly(settings: WindSettings, seed: int, steps: int) -> list[tuple[Place, Place]]:
    """Wind along a path that climbs through the jets' aim."""
    field = WindField(settings, np.random.default_rng(seed), STEP_S)
    winds = []
    for index in range(steps):
        time_s = index * STEP_S
        wind = field.step((0.1 * time_s - 0.5, 0.0, 0.5 + 0.1 * time_s), (0.1, 0.0, 0.1), time_s)
        winds.append((wind.free_in_world, wind.jet_in_world))
    return winds


def test_the_same_seed_gives_the_same_wind_bit_for_bit() -> None:
    """Two fields with one seed agree exactly over several noise blocks; another seed gives other wind."""
    assert fly(EVERYTHING, 1, 3000) == fly(EVERYTHING, 1, 3000)
    assert fly(EVERYTHING, 1, 100) != fly(EVERYTHING, 2, 100)


def test_winds_are_plain_floats() -> None:
    """No numpy scalar reaches the plant."""
    assert {type(value) for wind in fly(EVERYTHING, 1, 300) for vector in wind for value in vector} == {float}


def test_calm_settings_give_calm_air() -> None:
    """Without settings nothing blows, and nothing is drawn from the generator."""
    rng = np.random.default_rng(1)
    wind = WindField(WindSettings(), rng, STEP_S).step(AIM, REST, 10.0)
    assert wind.free_in_world == wind.jet_in_world == REST
    assert rng.standard_normal() == np.random.default_rng(1).standard_normal()


def test_mean_wind_is_that_of_the_height() -> None:
    """Without gusts the free wind is the profile at the vehicle's height, before the stop watch starts as well."""
    field = WindField(WindSettings(mean=BREEZE), np.random.default_rng(1), STEP_S)
    for height in (0.0, 1.5, 10.0):
        speed = 8.0 * math.log(height / 0.05) / math.log(200.0) if height > 0.05 else 0.0
        expected = (speed * math.cos(math.pi / 6), speed * math.sin(math.pi / 6), 0.0)
        assert field.step((3.0, -2.0, height), REST, None).free_in_world == pytest.approx(expected, abs=1e-12)


def test_gusts_are_aligned_with_the_mean_wind() -> None:
    """Along the mean wind blows u, to its left v, upward w, each as DrydenGusts gives it at the hover's airspeed."""
    settings = WindSettings(mean=BREEZE, gusts="dryden")
    field = WindField(settings, np.random.default_rng(3), STEP_S)
    mean = 8.0 * math.log(1.5 / 0.05) / math.log(200.0)
    w20 = 8.0 * math.log(6.096 / 0.05) / math.log(200.0)
    gusts = DrydenGusts(w20, np.random.default_rng(3), STEP_S)
    along, left = np.array((math.cos(math.pi / 6), 0.5)), np.array((-0.5, math.cos(math.pi / 6)))
    for _ in range(500):
        u, v, w = gusts.step(1.5, mean)
        expected = (*((mean + u) * along + v * left).tolist(), w)
        assert field.step(AIM, REST, None).free_in_world == pytest.approx(expected, abs=1e-9)


def test_gusts_pass_at_the_speed_relative_to_the_mean_wind() -> None:
    """A vehicle flying against the wind meets the gusts faster: they decorrelate in proportion."""

    def correlation(velocity: tuple[float, float, float]) -> float:
        settings = WindSettings(mean=ConstantWind(velocity_in_world_m_s=(5.0, 0.0, 0.0)), gusts="dryden")
        field = WindField(settings, np.random.default_rng(4), 0.05)
        vertical = np.array([field.step((0.0, 0.0, 5.0), velocity, None).free_in_world[2] for _ in range(40_000)])
        return float((vertical[10:] * vertical[:-10]).mean() / vertical.var())

    def theory(speed: float) -> float:
        ratio = 0.5 * speed / 5.0
        return math.exp(-ratio) * (1.0 - 0.5 * ratio)

    assert correlation(REST) == pytest.approx(theory(5.0), abs=0.05)
    assert correlation((-5.0, 0.0, 0.0)) == pytest.approx(theory(10.0), abs=0.05)


def test_hover_in_gusty_wind_meets_the_sigmas_of_its_height() -> None:
    """At 1.5 m under 8 m/s at 10 m the gusts have sigma 1.44 m/s level and 0.73 m/s upright (W20 7.25 m/s)."""
    field = WindField(WindSettings(mean=BREEZE, gusts="dryden"), np.random.default_rng(5), 0.05)
    record: Array = np.array([field.step(AIM, REST, None).free_in_world for _ in range(150_000)])
    expected = low_altitude_parameters(1.5, 7.253)
    assert (expected.sigma_u_m_s, expected.sigma_w_m_s) == pytest.approx((1.44, 0.725), abs=0.01)
    level = math.hypot(*record[:, :2].std(axis=0)) / math.sqrt(2.0)
    assert (level, record[:, 2].std()) == pytest.approx((expected.sigma_u_m_s, expected.sigma_w_m_s), rel=0.03)


def test_jets_add_up_and_keep_their_own_clock() -> None:
    """Two jets at one place add; before their start, and before the stop watch, there is only the free wind."""
    still = WindSettings(mean=BREEZE, jets=(blower(0.0, 0.0), blower(90.0, 0.0)))
    field = WindField(still, np.random.default_rng(6), STEP_S)
    free = field.step(AIM, REST, None)
    assert free.jet_in_world == field.step(AIM, REST, 0.4).jet_in_world == REST
    blown = field.step(AIM, REST, 0.5)
    assert blown.jet_in_world == pytest.approx((10.0, 10.0, 0.0))
    assert blown.free_in_world == free.free_in_world


def test_the_gusts_of_a_seed_do_not_depend_on_how_it_is_flown() -> None:
    """Whatever the path and the stop watch, the generator has given the same numbers after the same steps."""
    first, second = np.random.default_rng(7), np.random.default_rng(7)
    one, other = WindField(EVERYTHING, first, STEP_S), WindField(EVERYTHING, second, STEP_S)
    for index in range(2500):
        one.step(AIM, REST, None)
        other.step((0.01 * index, 3.0, 20.0), (2.5, 0.0, 0.0), index * STEP_S)
    assert first.standard_normal() == second.standard_normal()


def test_settings_can_be_written_to_a_log_and_read_back() -> None:
    """model_dump gives plain data that validates to equal settings."""
    assert WindSettings.model_validate(EVERYTHING.model_dump()) == EVERYTHING
    assert WindSettings.model_validate_json(EVERYTHING.model_dump_json()) == EVERYTHING
