"""Markers that come back, and markers that have been moved: the estimate never steps, and goes where it should."""

from __future__ import annotations

import numpy as np
import pytest

from tests.observer.airframes import f550
from tests.observer.test_consistency import MARKER, SIGHTING_COVARIANCE
from tests.observer.truth import flights, fly_commands
from uasfly.messages import Array, MarkerSample, OdometrySample
from uasfly.observer import Observer
from uasfly.observer.glide import SPEED_M_S, Glide

DT_S = 0.01
LATE = 12  # samples that a sighting is late


def fly(until_s: float, hidden_s: tuple[float, float], walk_m_s: Array, moved_s: float = 1e9) -> tuple[Array, Observer]:
    """Errors (n, 3) [m] of what is told, every 0.01 s; GNSS walks away while the marker is hidden, or it is moved."""
    rng = np.random.default_rng(1)
    airframe = f550(gnss_bias_density=0.1, attitude_wander_rad=0.0)
    truth = flights(airframe, 1, rng)
    observer = Observer(airframe)
    observer.retakes_moved = True
    fly_commands(observer, until_s)
    errors: list[Array] = []
    under_way: list[MarkerSample] = []
    for k in range(round(until_s / DT_S) + 1):
        time_s = k * DT_S
        truth.advance(airframe, time_s, rng)
        (sample,) = truth.odometry(airframe, rng)
        gone_m = walk_m_s * min(max(time_s - hidden_s[0], 0.0), hidden_s[1] - hidden_s[0])
        observer.add(
            OdometrySample(
                sample.time_s,
                sample.position_in_world + gone_m,
                sample.velocity_in_world,
                sample.quaternion_body_to_world,
                sample.angular_rate_in_body,
            )
        )
        if k % 8 == 0 and not hidden_s[0] < time_s < hidden_s[1]:
            place = MARKER + (0.5 if time_s >= moved_s else 0.0) * np.eye(7)[0]
            under_way += truth.sightings(place, SIGHTING_COVARIANCE, rng)
        if len(under_way) > 1:
            observer.add(under_way.pop(0))
        estimate = observer.estimate(time_s)
        assert estimate is not None
        errors.append(estimate.position_in_world - truth.position[0])
    return np.array(errors), observer


def test_a_marker_that_comes_back_is_flown_to_without_a_step() -> None:
    """Half a metre astray after 25 s without it: what is told glides back at its speed."""
    errors, _ = fly(45.0, (5.0, 30.0), np.array((0.04, 0.0, 0.0)))
    assert float(np.linalg.norm(errors[2950:3010] - errors[490], axis=1).max()) > 0.15
    assert float(np.abs(np.diff(errors[600:], axis=0)).max()) < 0.045  # 0.036 by GNSS's noise without it


def test_a_bundle_that_is_moved_is_not_followed() -> None:
    """It is told within a second, and the estimate stays where it is: the marker is taken anew where it is now."""
    errors, observer = fly(14.0, (1e9, 1e9), np.zeros(3), moved_s=8.0)
    ((number, away_m),) = observer.take_moved()
    assert away_m == pytest.approx(0.5, abs=0.05)
    moment = observer.moment
    assert moment is not None
    assert moment.markers == (number,)
    assert float(np.linalg.norm(errors[700:], axis=1).max()) < 0.1
    assert observer.take_moved() == []


def test_a_glide_takes_up_another_step_where_it_is() -> None:
    """Steps add up, the offset shrinks at its speed and ends."""
    glide = Glide()
    glide.stepped(0.0, np.array((0.01, 0.0, 0.0)))
    assert not glide.active(0.0)  # too small
    glide.stepped(1.0, np.array((0.5, 0.0, 0.0)))
    assert glide.offset(1.0) == pytest.approx([-0.5, 0.0, 0.0])
    assert glide.offset(2.0) == pytest.approx([SPEED_M_S - 0.5, 0.0, 0.0])
    glide.stepped(2.0, np.array((0.0, 0.3, 0.0)))
    assert glide.offset(2.0) == pytest.approx([SPEED_M_S - 0.5, -0.3, 0.0])
    assert not glide.active(9.0)
    assert glide.offset(9.0) == pytest.approx([0.0, 0.0, 0.0])
