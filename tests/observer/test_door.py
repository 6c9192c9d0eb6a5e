from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from uasfly.messages import MarkerSample, OdometrySample
from uasfly.observer.door import checked_odometry, checked_sighting

SAMPLE = OdometrySample(1.0, np.zeros(3), np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3))
SIGHTING = MarkerSample(1.0, 3, np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)), 1e-4 * np.eye(6))
BAD = [np.nan, np.inf, -np.inf, 1e300]


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize(
    ("field", "use"),
    [
        ("position_in_world", (1.0, 0.0, 1.0)),
        ("velocity_in_world", (1.0, 1.0, 0.0)),
        ("quaternion_body_to_world", (0.0, 1.0, 1.0)),
    ],
)
def test_only_the_part_with_a_bad_number_is_left_out(bad: float, field: str, use: tuple[float, ...]) -> None:
    """PX4 sends NaN for what it does not know; the rest of the sample is good."""
    values = getattr(SAMPLE, field).copy()
    values[1] = bad
    odometry = checked_odometry(dataclasses.replace(SAMPLE, **{field: values}))
    assert odometry is not None
    assert odometry.use == use
    assert not odometry.complete
    assert np.all(np.isfinite(odometry.position + odometry.velocity + odometry.quaternion))


def test_a_bad_rate_is_left_out() -> None:
    """The attitude is then predicted with the rate before."""
    odometry = checked_odometry(dataclasses.replace(SAMPLE, angular_rate_in_body=np.array((0.0, np.nan, 0.0))))
    assert odometry is not None
    assert odometry.rate is None
    assert not odometry.complete


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_sample_without_a_time_stays_outside(bad: float) -> None:
    """Nothing can be done with it."""
    assert checked_odometry(dataclasses.replace(SAMPLE, time_s=bad)) is None
    assert checked_sighting(dataclasses.replace(SIGHTING, time_s=bad)) is None


def test_a_sample_with_nothing_usable_stays_outside() -> None:
    """All parts NaN."""
    nothing = np.full(3, np.nan)
    sample = OdometrySample(1.0, nothing, nothing, np.full(4, np.nan), nothing)
    assert checked_odometry(sample) is None


@pytest.mark.parametrize("quaternion", [(0.0, 0.0, 0.0, 0.0), (0.5, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 0.0)])
def test_a_quaternion_that_is_no_rotation_is_left_out(quaternion: tuple[float, ...]) -> None:
    """MAVLink's float noise is normalised away; a length far from one is not a rotation."""
    odometry = checked_odometry(dataclasses.replace(SAMPLE, quaternion_body_to_world=np.array(quaternion)))
    assert odometry is not None
    assert odometry.use[0] == 0.0
    rounded = checked_odometry(dataclasses.replace(SAMPLE, quaternion_body_to_world=np.array((0.8001, 0.6, 0.0, 0.0))))
    assert rounded is not None
    assert np.linalg.norm(rounded.quaternion) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("field", ["position_in_body", "quaternion_marker_to_body", "covariance"])
def test_a_sighting_with_a_bad_number_stays_outside(bad: float, field: str) -> None:
    """Position, attitude or covariance."""
    values = getattr(SIGHTING, field).copy()
    values[..., 1] = bad
    assert checked_sighting(dataclasses.replace(SIGHTING, **{field: values})) is None


def test_a_sighting_whose_covariance_is_not_positive_definite_stays_outside() -> None:
    """A detector that is certain of something is wrong."""
    covariance = 1e-4 * np.eye(6)
    covariance[2, 2] = 0.0
    assert checked_sighting(dataclasses.replace(SIGHTING, covariance=covariance)) is None
    assert checked_sighting(SIGHTING) is not None


@pytest.mark.parametrize("rate", [50.0, 21196.0, 1e6])
def test_a_turn_that_no_gyro_can_measure_is_left_out(rate: float) -> None:
    """No gate holds it back: the filter turns by it, and one such sample threw the estimate beyond all bounds."""
    odometry = checked_odometry(dataclasses.replace(SAMPLE, angular_rate_in_body=np.array((0.0, rate, 0.0))))
    assert odometry is not None
    assert odometry.rate is None


def test_a_speed_that_no_vehicle_has_is_left_out() -> None:
    """The first sample meets no gate."""
    odometry = checked_odometry(dataclasses.replace(SAMPLE, velocity_in_world=np.array((0.0, 0.0, 2000.0))))
    assert odometry is not None
    assert odometry.use == (1.0, 1.0, 0.0)
