"""The horizontal force without the thrust."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.messages import Array
from uasfly.wind.drag_curve import DragCurve
from uasfly.wind.thrust_free import impulses, slopes, thrust

CURVE = DragCurve(0.2, 0.016)
ROLL, PITCH, YAW = 0.2, -0.3, 1.1


def flown(wind: Array, velocity: Array, push: float, quaternion: Array) -> Array:
    """Acceleration (3,) with a thrust of `push` along the body's z axis and the drag in the plane of its rotors."""
    rotation = rotation_matrix(quaternion)
    air = rotation.T @ (wind - velocity)
    drag = CURVE.ratio(float(np.linalg.norm(air))) * np.array((air[0], air[1], 0.0))
    result: Array = rotation @ (drag + np.array((0.0, 0.0, push))) - np.array((0.0, 0.0, GRAVITY_M_S2))
    return result


@pytest.mark.parametrize("push", [5.0, GRAVITY_M_S2, 16.0])
@pytest.mark.parametrize("climb", [0.0, 2.0])
def test_the_force_is_the_drags_whatever_the_thrust(push: float, climb: float) -> None:
    """H = k (u_h - s u_z), tilted, turned and climbing; the thrust does not show."""
    quaternion = quaternion_from_euler(ROLL, PITCH, YAW)
    wind, velocity = np.array((4.0, -3.0, 0.0)), np.array((1.0, 2.0, climb))
    step_s = 0.02
    after = velocity + step_s * flown(wind, velocity, push, quaternion)
    slope = slopes(np.array((quaternion, quaternion)))
    force = impulses(np.array((0.0, step_s)), np.array((velocity, after)), slope)[0] / step_s
    air = wind - velocity
    expected = CURVE.ratio(float(np.linalg.norm(air))) * (air[:2] - slope[0] * air[2])
    np.testing.assert_allclose(force, expected, atol=1e-12)


def test_the_slope_is_the_body_z_axis() -> None:
    """Over its vertical part, against the rotation matrix."""
    quaternion = quaternion_from_euler(ROLL, PITCH, YAW)
    axis = rotation_matrix(quaternion)[:, 2]
    np.testing.assert_allclose(slopes(quaternion[None, :])[0], axis[:2] / axis[2], atol=1e-12)


def test_the_thrust_carries_the_weight_and_lifts() -> None:
    """Level it is gravity and acceleration; tilted by 60 degrees twice that."""
    assert thrust(1.0, (0.0, 0.0)) == pytest.approx(GRAVITY_M_S2 + 1.0)
    assert thrust(0.0, (math.tan(math.radians(60.0)), 0.0)) == pytest.approx(2.0 * GRAVITY_M_S2)
