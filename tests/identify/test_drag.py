"""The drag out of flights in calm air."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.wind.steady_air import estimates
from uasfly.airframe import GRAVITY_M_S2
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.drivers.watching import Cycle
from uasfly.errors import UasflyError
from uasfly.identify.drag import identify_drag, moments
from uasfly.messages import StateEstimate, Status
from uasfly.sim.plant import AIR_DENSITY_KG_M3, Plant
from uasfly.wind.drag_curve import DragCurve

SHORT = [
    "airframe.limits.speed_m_s=10",
    "mission.legs=[{type: back_and_forth, start_m: [0, 0, 3], end_m: [25, 0, 3], speed_m_s: 4, passes: 2}, "
    "{type: back_and_forth, start_m: [0, 0, 3], end_m: [80, 0, 3], speed_m_s: 10, passes: 2}]",
]


def still_air_drag(plant: Plant, airspeed: float) -> float:
    """What the plant's own figures give for a level vehicle whose rotors turn as in hover [m/s^2]."""
    rotors = plant.rotors
    hover = math.sqrt(plant.mass_kg * GRAVITY_M_S2 / (rotors.count * rotors.thrust_coefficient))
    linear = rotors.count * hover * rotors.flapping_kg / plant.mass_kg
    return linear * airspeed + 0.5 * AIR_DENSITY_KG_M3 * plant.drag.area_m2[0] / plant.mass_kg * airspeed**2


@pytest.mark.parametrize("airframe", ["f550", "aurelia_x6"])
def test_a_calm_flight_to_and_fro_shows_the_plants_drag(airframe: str) -> None:
    """A minute with noisy sensors: within 6 % of the plant's curve from 3 to 9 m/s (rotors turn slower in fast air).

    And the shipped airframe says the same, within three of its sigmas and of the short flight's.
    """
    plan = load_plan("drag", airframe, scenario="calm", seed=5, settings=SHORT)
    seen: list[StateEstimate] = []

    def watch(status: Status, _: Cycle) -> None:
        if status.leg_started and status.estimate is not None:
            seen.append(status.estimate)

    assert rehearse(plan, watch=watch)["outcome"] == "completed"
    found = identify_drag([moments(seen)])
    curve = DragCurve(found.drag_1_s, found.drag_1_m)
    assert plan.plant is not None
    assert plan.airframe.wind is not None
    shipped = DragCurve(plan.airframe.wind.drag_1_s, plan.airframe.wind.drag_1_m)
    for airspeed in (3.0, 6.0, 9.0):
        assert curve.force(airspeed) == pytest.approx(still_air_drag(plan.plant, airspeed), rel=0.06)
        by_parts = np.array((airspeed, airspeed**2))
        sigma = math.sqrt(by_parts @ found.covariance @ by_parts)
        own = plan.airframe.wind.drag_sigma_share * shipped.force(airspeed)
        assert abs(curve.force(airspeed) - shipped.force(airspeed)) < 3.0 * math.hypot(sigma, own)
    assert np.abs(found.winds).max() < 0.15
    assert 9.9 < found.fastest_m_s < 10.5


def test_two_flights_in_light_steady_winds_are_told_apart_from_the_drag() -> None:
    """Each with its own wind, both ways at two speeds, without noise: the curve comes back to 0.1 %."""
    true = DragCurve(0.2, 0.015)
    flights = []
    for wind in ((1.0, -0.5), (0.0, 0.7)):
        parts: list[StateEstimate] = []
        for k, speed in enumerate((-9.0, -4.0, 4.0, 9.0)):
            parts += estimates(true, wind, 12.0, velocity=(speed, 0.0), begin_s=100.0 + 20.0 * k)
        flights.append(moments(parts))
    found = identify_drag(flights)
    assert (found.drag_1_s, found.drag_1_m) == pytest.approx((0.2, 0.015), rel=1e-3)
    np.testing.assert_allclose(found.winds, ((1.0, -0.5), (0.0, 0.7)), atol=1e-3)


@pytest.mark.parametrize(("duration_s", "speed", "found"), [(5.0, 9.0, "found 4 s"), (60.0, 1.0, "1.0 m/s")])
def test_too_short_or_too_slow_a_flight_is_refused(duration_s: float, speed: float, found: str) -> None:
    """It says what was expected, what was found and what to fly."""
    flown = moments(estimates(DragCurve(0.2, 0.01), (0.0, 0.0), duration_s, velocity=(speed, 0.0)))
    with pytest.raises(UasflyError, match="fly the mission drag") as refusal:
        identify_drag([flown])
    assert found in str(refusal.value)


def test_no_flight_at_all_is_refused() -> None:
    """Neither a log without estimates nor none."""
    for flights in ([], [moments([])]):
        with pytest.raises(UasflyError, match="found 0 s"):
            identify_drag(flights)
