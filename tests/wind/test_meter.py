"""The anemometer, on estimates without errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.wind.steady_air import estimates
from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.files import find_file, load_file
from uasfly.frames import rotation_matrix
from uasfly.messages import AccelerometerSample, OdometrySample, StateEstimate
from uasfly.wind.drag_curve import DragCurve
from uasfly.wind.meter import INTERVAL_S, WindMeter
from uasfly.wind.thrust_free import slopes
from uasfly.wind_messages import WindEstimate

AIRFRAME = load_file(find_file("airframe", "f550"), Airframe)
assert AIRFRAME.wind is not None
CURVE = DragCurve(AIRFRAME.wind.drag_1_s, AIRFRAME.wind.drag_1_m)
K_THRUST = AIRFRAME.model.k_thrust_m_s2


def meter() -> WindMeter:
    """The f550's."""
    assert AIRFRAME.wind is not None
    return WindMeter(AIRFRAME.wind, AIRFRAME.limits)


def told(measured: WindMeter, of: list[StateEstimate], *, in_air: bool = True) -> list[WindEstimate | None]:
    """What it says in each cycle, with a sample 5 ms before it."""
    winds = []
    for estimate in of:
        measured.add(sample(estimate))
        winds.append(measured.step(estimate.time_s, estimate, in_air, K_THRUST))
    return winds


def sample(of: StateEstimate) -> OdometrySample:
    """What PX4 tells of the same motion."""
    attitude, rate = of.quaternion_body_to_world, of.angular_rate_in_body
    return OdometrySample(of.time_s - 0.005, of.position_in_world, of.velocity_in_world, attitude, rate)


def wind_towards(speed: float, from_deg: float) -> tuple[float, float]:
    """East and north of a wind from a direction."""
    angle = math.radians(from_deg)
    return -speed * math.sin(angle), -speed * math.cos(angle)


@pytest.mark.parametrize("from_deg", [0.0, 90.0, 200.0, 315.0])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (2.0, -1.0)])
def test_a_steady_wind_is_told_with_the_direction_it_comes_from(from_deg: float, velocity: tuple[float, float]) -> None:
    """Standing or flying: the same wind, from north over east; mean, present and gust agree."""
    wind = wind_towards(7.0, from_deg)
    last = told(meter(), list(estimates(CURVE, wind, 14.0, velocity=velocity)))[-1]
    assert last is not None
    np.testing.assert_allclose(last.velocity_in_world, wind, atol=1e-3)
    assert last.mean_speed_m_s == pytest.approx(7.0, abs=1e-3)
    assert abs((last.mean_from_deg - from_deg + 180.0) % 360.0 - 180.0) < 0.05
    assert last.gust_m_s == pytest.approx(7.0, abs=1e-3)
    assert last.variability_m_s < 1e-3
    assert last.averaged_s == pytest.approx(10.0)


def test_nothing_is_told_on_the_ground_and_soon_in_the_air() -> None:
    """Known within 5 s of flying; after landing unknown again, and the wind before is forgotten."""
    measured = meter()
    strong, weak = wind_towards(9.0, 30.0), wind_towards(2.0, 210.0)
    assert not any(told(measured, list(estimates(CURVE, strong, 5.0)), in_air=False))
    first = told(measured, list(estimates(CURVE, strong, 10.0, begin_s=105.0)))
    known = next(k for k, wind in enumerate(first) if wind is not None)
    assert 1.0 < known * 0.02 < 5.0
    assert told(measured, list(estimates(CURVE, strong, 0.1, begin_s=115.0)), in_air=False)[-1] is None
    again = told(measured, list(estimates(CURVE, weak, 5.0, begin_s=120.0)))[-1]
    assert again is not None
    assert again.gust_m_s == pytest.approx(2.0, abs=0.01)


def test_the_wind_is_that_of_its_own_time() -> None:
    """The estimate is 0.3 s older than the last sample when it is made, and a new one comes five times a second."""
    of = list(estimates(CURVE, (3.0, 0.0), 6.0))
    winds = told(meter(), of)
    new = [(e.time_s, w) for e, w, before in zip(of[1:], winds[1:], winds, strict=False) if w is not before and w]
    assert np.diff([now for now, _ in new]) == pytest.approx(INTERVAL_S, abs=0.021)
    assert new[-1][0] - new[0][0] == pytest.approx((len(new) - 1) * INTERVAL_S, abs=0.021)
    assert all(now - wind.time_s == pytest.approx(0.305) for now, wind in new)


def test_calm_has_no_direction() -> None:
    """A mean that is weaker than its sigma comes from nowhere; speed and sigma are told."""
    last = told(meter(), list(estimates(CURVE, (0.02, 0.0), 5.0)))[-1]
    assert last is not None
    assert math.isnan(last.mean_from_deg)
    assert last.mean_speed_m_s < last.mean_speed_sigma_m_s < 0.5


@pytest.mark.parametrize("change", ["pause", "unknown velocity", "no estimate"])
def test_what_cannot_be_followed_makes_the_wind_unknown(change: str) -> None:
    """A gap or a velocity that is not known: unknown first, known again later."""
    measured = meter()
    assert told(measured, list(estimates(CURVE, (5.0, 0.0), 5.0)))[-1] is not None
    later = list(estimates(CURVE, (5.0, 0.0), 5.0, begin_s=105.0 + (1.0 if change == "pause" else 0.0)))
    if change == "unknown velocity":
        later[:20] = [replace(estimate, velocity_sigma_m_s=np.full(3, 2.0)) for estimate in later[:20]]
    if change == "no estimate":
        assert measured.step(105.0, None, in_air=True, k_thrust_m_s2=K_THRUST) is None
    winds = told(measured, later)
    assert any(wind is None for wind in winds[:20])
    assert winds[-1] is not None


def test_silence_makes_the_wind_unknown() -> None:
    """The observer goes on by its model, which knows nothing new of the wind."""
    measured = meter()
    of = list(estimates(CURVE, (5.0, 0.0), 6.0))
    assert told(measured, of[:200])[-1] is not None
    silent = [measured.step(estimate.time_s, estimate, True, K_THRUST) for estimate in of[200:240]]
    assert silent[-1] is None


@pytest.mark.parametrize("bad", ["spike", "nan", "attitude nan", "late", "far ahead"])
def test_a_sample_that_is_not_believed_changes_nothing(bad: str) -> None:
    """Velocity far from the estimate, no numbers, or a time that cannot be: left out, the wind stays as it was."""
    measured = meter()
    for k, estimate in enumerate(estimates(CURVE, (5.0, 0.0), 6.0)):
        good = sample(estimate)
        wrong = {
            "spike": replace(good, velocity_in_world=np.array((2.0, 0.0, 0.0))),
            "nan": replace(good, velocity_in_world=np.full(3, math.nan)),
            "attitude nan": replace(good, quaternion_body_to_world=np.full(4, math.nan)),
            "late": replace(good, time_s=good.time_s - 0.3, velocity_in_world=np.array((0.4, 0.0, 0.0))),
            "far ahead": replace(good, time_s=good.time_s + 20.0),
        }[bad]
        measured.add(wrong if k % 10 == 5 else good)
        wind = measured.step(estimate.time_s, estimate, True, K_THRUST)
        if k > 150:
            assert wind is not None
            np.testing.assert_allclose(wind.velocity_in_world, (5.0, 0.0), atol=1e-2)


def test_the_margin_is_what_the_wind_leaves_of_tilt_and_thrust() -> None:
    """In the wind that can just be held nothing is left; a thrust that carries less holds less."""
    limit = told(meter(), list(estimates(CURVE, (3.0, 0.0), 5.0)))[-1]
    assert limit is not None
    force = GRAVITY_M_S2 * math.tan(AIRFRAME.limits.tilt_rad)
    thrust = math.hypot(GRAVITY_M_S2, force)
    assert CURVE.under_thrust(thrust).force(limit.holdable_m_s) == pytest.approx(force)
    assert limit.margin == pytest.approx(1.0 - CURVE.under_thrust(thrust).force(limit.gust_m_s) / force)
    at_limit = told(meter(), list(estimates(CURVE, (limit.holdable_m_s, 0.0), 5.0)))[-1]
    assert at_limit is not None
    assert at_limit.margin == pytest.approx(0.0, abs=1e-3)
    measured = meter()
    told(measured, list(estimates(CURVE, (3.0, 0.0), 4.9)))
    later = next(estimates(CURVE, (3.0, 0.0), 1.0, begin_s=105.1))
    measured.add(sample(later))
    weak = measured.step(later.time_s, later, True, 16.0)
    assert weak is not None
    assert weak.holdable_m_s < limit.holdable_m_s


def felt_by(of: StateEstimate, pushed: tuple[float, float]) -> AccelerometerSample:
    """What the accelerometer reads where the air pushes so, horizontally, as at the end of `told`'s cycles."""
    force = rotation_matrix(of.quaternion_body_to_world).T @ (*pushed, 0.0)
    return AccelerometerSample(of.time_s - 0.005, np.array((force[0], force[1], 9.8)))


@pytest.mark.parametrize("wrong", [None, math.nan, 3.0])
def test_with_an_accelerometer_the_wind_is_told_as_it_is_just_now(wrong: float | None) -> None:
    """The same wind, 50 ms old instead of 300; where it says nothing, garbage or the contrary, as without it."""
    wind, measured = wind_towards(7.0, 60.0), meter()
    before = meter()
    last, without = None, None
    for k, estimate in enumerate(estimates(CURVE, wind, 8.0)):
        slope_x, slope_y = (float(v) for v in slopes(estimate.quaternion_body_to_world[None])[0])
        pushed = (-GRAVITY_M_S2 * slope_x, -GRAVITY_M_S2 * slope_y)
        for one in (measured, before):
            one.add(sample(estimate))
        if wrong is None or k < 200:
            measured.add(felt_by(estimate, pushed))
        else:
            measured.add(AccelerometerSample(estimate.time_s - 0.005, np.array((wrong, 0.0, 9.8))))
        last = measured.step(estimate.time_s, estimate, True, K_THRUST)
        without = before.step(estimate.time_s, estimate, True, K_THRUST)
    assert last is not None
    assert without is not None
    np.testing.assert_allclose(last.velocity_in_world, wind, atol=0.02)
    age_s = 107.98 - last.time_s
    if wrong is None:
        assert age_s < 0.25  # of which 0.2 s until it is renewed
        assert age_s < 107.98 - without.time_s - 0.2
    else:
        assert last.time_s == without.time_s
        assert last.velocity_in_world.tolist() == without.velocity_in_world.tolist()
