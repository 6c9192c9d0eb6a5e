"""The view of the vehicle: the last sample of each kind, answers and texts of this step only."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from uasfly.flight.view import VehicleView
from uasfly.messages import (
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    OdometrySample,
    Request,
    RequestKind,
    RequestResult,
    TextSample,
    VehicleSample,
)

ZERO = np.zeros(3)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def _odometry(time_s: float) -> OdometrySample:
    return OdometrySample(time_s, ZERO, ZERO, LEVEL, ZERO)


def test_before_anything_is_heard_nothing_is_assumed() -> None:
    """No mode, not armed, not in the air, infinitely old odometry, unknown voltage."""
    view = VehicleView()
    assert view.mode is FlightMode.OTHER
    assert not view.armed
    assert not view.in_air
    assert view.odometry_age_s(5.0) == math.inf
    assert view.voltage_v is None


def test_the_last_sample_of_each_kind_is_kept() -> None:
    """Steps without news change nothing."""
    view = VehicleView()
    health = HealthSample(1.0, True, True, True, 3, 12, 0.4)
    target = AttitudeTargetSample(1.0, LEVEL, 0.3)
    vehicle = VehicleSample(1.0, FlightMode.OFFBOARD, armed=True, in_air=True)
    view.update((VehicleSample(0.0, FlightMode.HOLD, False, False), vehicle, health, target, _odometry(1.0)))
    view.update(())
    assert (view.vehicle, view.health, view.attitude_target) == (vehicle, health, target)
    assert (view.mode, view.armed, view.in_air) == (FlightMode.OFFBOARD, True, True)
    assert view.odometry_age_s(1.3) == pytest.approx(0.3)


def test_answers_and_texts_are_those_of_one_step() -> None:
    """They are gone with the next step, so that nothing acts on them twice."""
    view = VehicleView()
    result = RequestResult(1.0, Request(RequestKind.ARM), accepted=True)
    text = TextSample(1.0, 4, "gust")
    view.update((result, text))
    assert view.results == [result]
    assert view.texts == [text]
    view.update(())
    assert view.results == []
    assert view.texts == []


def test_one_stamp_from_the_future_does_not_hide_later_silence() -> None:
    """Odometry from the future is as old as it is early, and the next sample replaces it."""
    view = VehicleView()
    view.update((_odometry(1000.0),))
    assert view.odometry_age_s(1.0) == pytest.approx(999.0)
    view.update((_odometry(1.0),))
    assert view.odometry_age_s(3.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("voltage_v", "known"), [(14.8, True), (0.0, False), (-1.0, False), (math.nan, False)])
def test_a_voltage_that_is_none_is_unknown(voltage_v: float, known: bool) -> None:
    """Zero, negative and unknown voltages never reach the thrust map."""
    view = VehicleView()
    view.update((BatterySample(1.0, voltage_v, math.nan),))
    assert view.voltage_v == (voltage_v if known else None)


def test_infinities_of_both_signs_are_no_velocity() -> None:
    """Their sum is not a number, and numpy would say so in the terminal."""
    view = VehicleView()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        view.update((OdometrySample(1.0, ZERO, np.array((math.inf, -math.inf, 0.0)), LEVEL, ZERO),))
    assert view.odometry is None
