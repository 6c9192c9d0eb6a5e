"""References that can be flown."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.control.vehicle import f550
from uasfly.control.references import input_reference_function, reference_stage_function, trim_function
from uasfly.control.transcription import interval_function
from uasfly.messages import Array
from uasfly.model import INPUTS, PARAMETERS, STATES, controller_dynamics, controller_parameters

LIMITS = np.array((np.radians(30.0), 0.15, 0.75))
MODEL = f550().model
TRIM = trim_function()
_symbols = [ca.SX.sym("x", STATES), ca.SX.sym("u", INPUTS), ca.SX.sym("p", PARAMETERS), ca.SX.sym("yaw")]
DYNAMICS = ca.Function("f", _symbols, [controller_dynamics(*_symbols)])


def _trim(acceleration: Array, velocity: Array, yaw: float, force: Array, limits: Array = LIMITS) -> Array:
    parameters = controller_parameters(MODEL, np.zeros(3), 28.54209)
    return np.asarray(TRIM(acceleration, velocity, yaw, force, parameters, limits)).ravel()


def _flown(trim: Array, velocity: Array, yaw: float, force: Array) -> Array:
    parameters = controller_parameters(MODEL, force, 28.54209)
    state = np.concatenate((np.zeros(3), velocity, trim[:2]))
    return np.asarray(DYNAMICS(state, (trim[2], 0.0, 0.0), parameters, yaw)).ravel()[3:6]


def _vectors(size: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[st.floats(-size, size)] * 3)


@given(acceleration=_vectors(1.5), velocity=_vectors(2.0), force=_vectors(1.5), yaw=st.floats(-7.0, 7.0))
@settings(max_examples=100, deadline=None)
def test_the_trim_flies_the_reference(
    acceleration: tuple[float, ...], velocity: tuple[float, ...], force: tuple[float, ...], yaw: float
) -> None:
    """Inside the limits the model, at trim, accelerates exactly as the reference does, in any wind, at any yaw."""
    a, v, f = np.array(acceleration), np.array(velocity), np.array(force)
    np.testing.assert_allclose(_flown(_trim(a, v, yaw, f), v, yaw, f), a, atol=1e-6)


@given(acceleration=_vectors(60.0), velocity=_vectors(20.0), force=_vectors(20.0), yaw=st.floats(-7.0, 7.0))
@settings(max_examples=100, deadline=None)
def test_the_trim_never_leaves_the_limits(
    acceleration: tuple[float, ...], velocity: tuple[float, ...], force: tuple[float, ...], yaw: float
) -> None:
    """Whatever is asked, angles and thrust stay inside and finite."""
    roll, pitch, thrust = _trim(np.array(acceleration), np.array(velocity), yaw, np.array(force))
    assert abs(roll) <= MODEL.roll.gain * LIMITS[0] + 1e-12
    assert abs(pitch) <= MODEL.pitch.gain * LIMITS[0] + 1e-12
    assert LIMITS[1] <= thrust <= LIMITS[2]


def test_height_comes_before_the_track_when_thrust_is_short() -> None:
    """Asked for more than the rotors give, the vehicle keeps its height and gives up acceleration sideways."""
    limits = np.array((np.radians(40.0), 0.15, 0.38))
    trim = _trim(np.array((6.0, 0.0, 0.0)), np.zeros(3), 0.0, np.zeros(3), limits)
    flown = _flown(trim, np.zeros(3), 0.0, np.zeros(3))
    assert flown[2] == pytest.approx(0.0, abs=1e-6)
    assert 1.0 < flown[0] < 6.0


def test_height_is_kept_when_the_tilt_is_limited() -> None:
    """A clipped angle is made up for by the thrust."""
    trim = _trim(np.array((9.0, 5.0, 0.0)), np.zeros(3), 0.4, np.zeros(3))
    flown = _flown(trim, np.zeros(3), 0.4, np.zeros(3))
    assert flown[2] == pytest.approx(0.0, abs=1e-6)
    assert flown[0] > 3.0


def test_standing_in_wind_is_an_equilibrium_of_the_stages() -> None:
    """With the trim as state and input reference a stage in constant wind ends where it began: no cost, no offset."""
    force = np.array((1.3, -0.8, 0.4))
    parameters = controller_parameters(MODEL, force, 28.54209)
    trim = _trim(np.zeros(3), np.zeros(3), 0.6, force)
    inputs = np.asarray(
        input_reference_function()(trim, trim, parameters, 0.3, (0.15, -0.5, -0.5), (0.75, 0.5, 0.5))
    ).ravel()
    state = np.array((1.0, 2.0, 3.0, 0.0, 0.0, 0.0, trim[0], trim[1]))
    end = np.asarray(interval_function()(state, inputs, parameters, 0.6, 0.0, 0.3)).ravel()
    np.testing.assert_allclose(end, state, atol=1e-7)


def test_commands_lead_the_angles_by_the_attitude_loop() -> None:
    """Between nodes with different tilt the command overshoots so that the loop arrives at the second one."""
    parameters = controller_parameters(MODEL, np.zeros(3), 28.54209)
    start, end = np.array((0.0, 0.0, 0.34)), np.array((0.02, -0.01, 0.36))
    bounds = np.array((0.15, -0.5, -0.5)), np.array((0.75, 0.5, 0.5))
    inputs = np.asarray(input_reference_function()(start, end, parameters, 0.05, *bounds)).ravel()
    state = np.array((0.0,) * 6 + (start[0], start[1]))
    reached = np.asarray(interval_function()(state, inputs, parameters, 0.0, 0.0, 0.05)).ravel()
    np.testing.assert_allclose(reached[6:], end[:2], atol=4e-4)
    assert inputs[1] > end[0]
    assert inputs[0] == pytest.approx(0.35)


def test_input_references_stay_inside_the_bounds() -> None:
    """A jump of the reference tilt asks for a command at the bound, not beyond it."""
    parameters = controller_parameters(MODEL, np.zeros(3), 28.54209)
    lower, upper = np.array((0.15, -0.5, -0.5)), np.array((0.75, 0.5, 0.5))
    inputs = np.asarray(
        input_reference_function()((-0.4, 0.4, 0.1), (0.4, -0.4, 0.1), parameters, 0.02, lower, upper)
    ).ravel()
    np.testing.assert_allclose(inputs, (0.15, 0.5, -0.5))


def test_the_stage_function_is_trim_and_input_reference_in_one() -> None:
    """To the last digits, with the state reference put together from position, velocity and tilt."""
    rng, parameters = np.random.default_rng(3), controller_parameters(MODEL, np.zeros(3), 28.54209)
    lower, upper = np.array((0.15, -0.5, -0.5)), np.array((0.75, 0.5, 0.5))
    for _ in range(5):
        end, acceleration, velocity, position, force = rng.normal(size=(5, 3)) * (0.1, 0.2, 0.3)
        yaw, interval = rng.uniform(-3.0, 3.0), rng.uniform(0.02, 0.3)
        given = (end, acceleration, velocity, position, yaw, force, parameters, LIMITS, interval, lower, upper)
        results = [np.asarray(result).ravel() for result in reference_stage_function().call(list(given))]
        trim = _trim(acceleration, velocity, yaw, force)
        inputs = input_reference_function()(trim, end, parameters, interval, lower, upper)
        expected = (trim, np.concatenate((position, velocity, trim[:2])), np.asarray(inputs).ravel())
        for result, other in zip(results, expected, strict=True):
            np.testing.assert_allclose(result, other, atol=1e-14)
