from __future__ import annotations

import math
from functools import lru_cache

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from uasfly.frames import quaternion_from_euler, quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import Array
from uasfly.sim.attitude_control import follow_reference_model, rate_setpoint

LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
WIDE = np.full(3, 1e3)


def _symbols(*sizes: int) -> list[ca.SX]:
    return [ca.SX.sym(f"s{index}", size) for index, size in enumerate(sizes)]


@lru_cache(maxsize=4)
def _follower(step: float) -> ca.Function:
    symbols = _symbols(4, 3, 4, 1, 1)
    reference, rate, setpoint, yaw_rate, frequency = symbols
    after = follow_reference_model(reference, rate, setpoint, yaw_rate, frequency, step)
    return ca.Function("follow", symbols, list(after))


@lru_cache(maxsize=1)
def _asker() -> ca.Function:
    symbols = _symbols(4, 4, 1, 3, 1, 3)
    return ca.Function("ask", symbols, [rate_setpoint(*symbols)])


def followed(
    reference: Array, rate: Array, setpoint: Array, yaw_rate: float, frequency: float, step: float
) -> list[Array]:
    """Reference and its rate a step later."""
    return [np.array(value).squeeze() for value in _follower(step)(reference, rate, setpoint, yaw_rate, frequency)]


def wanted(
    attitude: Array, reference: Array, yaw_rate: float = 0.0, yaw_weight: float = 0.4, limits: Array = WIDE
) -> Array:
    """Rate setpoint with gains 6, 6 and 3."""
    return np.array(_asker()(attitude, reference, yaw_rate, (6.0, 6.0, 3.0), yaw_weight, limits)).squeeze()


def test_reference_step_is_the_matrix_exponential() -> None:
    """For small angles a step is exp([[0, -1], [w^2, -2 w]] dt) applied to error and rate."""
    error, rate, frequency, step = 1e-3, 4e-3, 30.0, 0.02
    setpoint = quaternion_from_rotation_vector(np.array((error, 0.0, 0.0)))
    reference, next_rate = followed(LEVEL, np.array((rate, 0.0, 0.0)), setpoint, 0.0, frequency, step)
    exact = expm(np.array(((0.0, -1.0), (frequency**2, -2.0 * frequency))) * step) @ (error, rate)
    assert error - 2.0 * reference[1] == pytest.approx(exact[0], abs=1e-9)
    assert next_rate[0] == pytest.approx(exact[1], abs=1e-8)


def test_reference_arrives_without_overshoot() -> None:
    """A step of the setpoint is followed without overshoot, also from the far side of the double cover."""
    setpoint = -quaternion_from_euler(0.3, 0.0, 0.0)
    reference, rate, rolls = LEVEL, np.zeros(3), []
    for _ in range(200):
        reference, rate = followed(reference, rate, setpoint, 0.0, 50.0, 0.004)
        rolls.append(2.0 * math.atan2(reference[1], reference[0]))
    assert rolls[-1] == pytest.approx(0.3, abs=1e-6)
    assert max(rolls) < 0.3 + 1e-6
    assert rolls[10] == pytest.approx(0.3 * (1.0 - (1.0 + 2.2) * math.exp(-2.2)), abs=5e-3)


def test_yaw_rate_turns_the_reference() -> None:
    """With the setpoint turning at the commanded rate the reference keeps up with it."""
    reference, rate = LEVEL, np.zeros(3)
    for step in range(100):
        yaw = 0.5 * 0.004 * (step + 1)
        reference, rate = followed(reference, rate, quaternion_from_euler(0.1, 0.0, yaw), 0.5, 50.0, 0.004)
    assert 2.0 * math.atan2(reference[3], reference[0]) == pytest.approx(0.2, abs=2e-3)


def test_small_errors_are_multiplied_by_the_gains() -> None:
    """A small rotation asks for gain times angle about each axis."""
    reference = quaternion_from_rotation_vector(np.array((0.01, -0.02, 0.03)))
    assert wanted(LEVEL, reference) == pytest.approx([0.06, -0.12, 0.09], rel=0.02)


def test_the_double_cover_is_harmless() -> None:
    """Both quaternions of an attitude ask for the same."""
    reference = quaternion_from_euler(0.3, -0.2, 1.0)
    assert wanted(LEVEL, -reference) == pytest.approx(wanted(LEVEL, reference))


def test_at_the_reference_nothing_is_asked() -> None:
    """No error, no rate; a yaw feed-forward turns about the world's vertical."""
    attitude = quaternion_from_euler(0.2, -0.4, 2.0)
    assert wanted(attitude, attitude) == pytest.approx(np.zeros(3), abs=1e-5)
    fed = wanted(attitude, attitude, yaw_rate=0.5)
    assert np.linalg.norm(fed) == pytest.approx(0.5, rel=1e-4)
    assert fed == pytest.approx(
        [0.5 * math.sin(0.4), 0.5 * math.cos(0.4) * math.sin(0.2), 0.5 * math.cos(0.4) * math.cos(0.2)], abs=1e-4
    )


def test_tilt_comes_before_yaw() -> None:
    """With a large yaw error the tilt is still corrected the shortest way; yaw is asked for less than its angle."""
    tilt = quaternion_from_euler(0.0, 0.3, 0.0)
    reference = quaternion_product(tilt, quaternion_from_euler(0.0, 0.0, 2.5))
    asked, plain = wanted(LEVEL, reference), wanted(LEVEL, tilt)
    assert math.hypot(asked[0], asked[1]) == pytest.approx(math.hypot(plain[0], plain[1]), rel=1e-6)
    assert math.degrees(math.atan2(asked[0], asked[1])) < math.degrees(0.4 * 2.5)
    assert 0.0 < asked[2] < 3.0 * 2.5


def test_rates_are_limited() -> None:
    """No axis asks for more than its limit."""
    asked = wanted(LEVEL, quaternion_from_euler(1.0, -1.0, 1.0), limits=np.array((1.5, 1.0, 0.5)))
    assert np.abs(asked) == pytest.approx([1.5, 1.0, 0.5])
