"""Prediction across the dead time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.control.vehicle import TICK_S, PointMass, f550
from uasfly.control.delay import LONGEST_PREDICTION_S, DelayPredictor, state_of
from uasfly.messages import Array, Setpoint
from uasfly.model import controller_parameters

FORCE = np.array((0.8, -0.5, 0.3))


def _setpoint(time_s: float, roll: float, pitch: float, thrust: float) -> Setpoint:
    return Setpoint(time_s, roll, pitch, 0.4, 0.0, thrust)


def _state(vehicle: PointMass) -> Array:
    return state_of(vehicle.position, vehicle.velocity, vehicle.roll, vehicle.pitch)


@pytest.mark.parametrize("delay_s", [0.02, 0.04, 0.1])
def test_the_prediction_is_where_an_independent_vehicle_arrives(delay_s: float) -> None:
    """Setpoints that change every cycle, in wind: state and yaw at the time the next command acts, to a millimetre."""
    airframe = f550(delay_s=delay_s)
    vehicle = PointMass(airframe, delay_s, roll=0.1, pitch=-0.05, yaw=0.4)
    vehicle.velocity = np.array((1.0, -0.5, 0.2))
    predictor = DelayPredictor(airframe.model)
    rng = np.random.default_rng(30)
    predictor.reset(vehicle.acting)
    parameters = controller_parameters(airframe.model, FORCE, 28.54209)
    predictions = []
    for cycle in range(20):
        vehicle.time_s = cycle * 0.02
        roll, pitch = rng.uniform(-0.3, 0.3, 2)
        setpoint = _setpoint(vehicle.time_s, roll, pitch, rng.uniform(0.25, 0.45))
        acts_s = vehicle.time_s + delay_s
        state, _ = predictor.predict(_state(vehicle), vehicle.yaw, vehicle.yaw_rate, parameters, vehicle.time_s, acts_s)
        predictions.append((acts_s, state))
        predictor.sent(setpoint)
        vehicle.send(setpoint)
        for _ in range(round(0.02 / TICK_S)):
            for acts_s, predicted in predictions:
                if math.isclose(acts_s, vehicle.time_s, abs_tol=1e-9):
                    np.testing.assert_allclose(_state(vehicle), predicted, atol=1e-3)
            vehicle.tick(FORCE)
    assert vehicle.time_s > delay_s + 0.2


def test_the_attitude_is_exact_across_several_setpoints() -> None:
    """Roll after two pieces of constant command is the closed solution of eq. 2, to rounding."""
    model = f550(delay_s=0.04).model
    predictor = DelayPredictor(model)
    predictor.reset(_setpoint(-1.0, 0.2, 0.0, 0.34))
    predictor.sent(_setpoint(0.0, -0.1, 0.0, 0.34))
    parameters = controller_parameters(model, np.zeros(3), 28.54209)
    state, yaw = predictor.predict(
        state_of(np.zeros(3), np.zeros(3), 0.05, 0.0), 0.4, 0.5, parameters, from_s=0.0, to_s=0.1
    )
    first = model.roll.gain * 0.2 + (0.05 - model.roll.gain * 0.2) * math.exp(-0.04 / model.roll.tau_s)
    second = model.roll.gain * -0.1 + (first + model.roll.gain * 0.1) * math.exp(-0.06 / model.roll.tau_s)
    assert state[6] == pytest.approx(second, abs=1e-14)
    assert yaw == pytest.approx(0.45)


def test_an_estimate_from_the_past_is_brought_up_to_date() -> None:
    """Predicting from 60 ms ago through what was sent since equals predicting on from the state in between."""
    model = f550(delay_s=0.03).model
    parameters = controller_parameters(model, FORCE, 28.54209)
    late, fresh = DelayPredictor(model), DelayPredictor(model)
    for predictor in (late, fresh):
        predictor.reset(_setpoint(-1.0, 0.1, 0.1, 0.3))
        for cycle in range(5):
            predictor.sent(_setpoint(0.02 * cycle, 0.05 * cycle, -0.05 * cycle, 0.3 + 0.02 * cycle))
    start = state_of(np.zeros(3), np.ones(3), 0.1, 0.0)
    between, yaw = late.predict(start, 0.4, 0.3, parameters, 0.02, 0.08)
    expected, _ = late.predict(between, yaw, 0.3, parameters, 0.08, 0.11)
    state, _ = fresh.predict(start, 0.4, 0.3, parameters, 0.02, 0.11)
    np.testing.assert_allclose(state, expected, atol=1e-6)


def test_before_anything_was_sent_the_attitude_is_kept() -> None:
    """Without knowledge of what the vehicle is told, it goes on as it stands."""
    model = f550().model
    predictor = DelayPredictor(model)
    parameters = controller_parameters(model, np.zeros(3), 28.54209)
    start = state_of(np.zeros(3), np.zeros(3), 0.2, -0.1)
    state, _ = predictor.predict(start, 0.0, 0.0, parameters, 0.0, 0.1)
    np.testing.assert_allclose(state[6:], (0.2, -0.1), atol=1e-12)
    assert abs(state[5]) < 1e-6


def test_no_time_is_no_motion_and_a_long_time_is_cut() -> None:
    """To the same instant, or backwards, the state is returned; more than half a second is not predicted."""
    model = f550().model
    predictor = DelayPredictor(model)
    parameters = controller_parameters(model, FORCE, 28.54209)
    start = state_of(np.zeros(3), np.ones(3), 0.1, 0.1)
    for to_s in (2.0, 1.9):
        state, yaw = predictor.predict(start, 0.3, 0.2, parameters, 2.0, to_s)
        np.testing.assert_array_equal(state, start)
        assert yaw == 0.3
    cut, _ = predictor.predict(start, 0.3, 0.2, parameters, 2.0, 2.0 + LONGEST_PREDICTION_S)
    long, _ = predictor.predict(start, 0.3, 0.2, parameters, 2.0, 60.0)
    np.testing.assert_array_equal(cut, long)
