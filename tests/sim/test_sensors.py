from __future__ import annotations

import math
from array import array

import numpy as np
import pytest

from uasfly.frames import quaternion_from_euler
from uasfly.sim.estimate import Estimate
from uasfly.sim.scenario import Sensors
from uasfly.sim.sensors import RawSensors, geographic_position

SETTINGS = Sensors(position="mocap", position_noise_m=0.01)


def sensors_at_rest(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> tuple[RawSensors, Estimate]:
    """Sensors of a vehicle that rests 100 m north of the origin in some attitude."""
    state = array("d", (0.0, 100.0, 2.0, 0.0, 0.0, 0.0, *quaternion_from_euler(roll, pitch, yaw), 0.0, 0.0, 0.0))
    estimate = Estimate(SETTINGS, np.random.default_rng(1), state, 0.004)
    still = array("d", (0.0, 0.0, 0.0))
    rngs = np.random.default_rng(2), np.random.default_rng(3)
    return RawSensors(rngs[0], state, still, estimate, SETTINGS, 500.0, rngs[1]), estimate


def test_at_rest_the_accelerometer_measures_gravity_upwards() -> None:
    """Specific force points up, in body axes; noise and bias have the sizes of PX4's simulator."""
    sensors, _ = sensors_at_rest(roll=0.5)
    rows = []
    for _ in range(2000):
        sensors.advance()
        rows.append(sensors.inertial(0.0).acceleration_in_body)
    mean = np.mean(rows, axis=0)
    assert mean == pytest.approx([0.0, 9.80665 * math.sin(0.5), 9.80665 * math.cos(0.5)], abs=0.2)
    assert np.std(rows, axis=0) == pytest.approx([0.07, 0.07, 0.07], rel=0.1)


def test_the_magnetometer_finds_north() -> None:
    """Levelled, the field points north and down."""
    sensors, _ = sensors_at_rest(yaw=math.pi / 2)  # nose to the north
    field = np.mean([_read_field(sensors) for _ in range(500)], axis=0)
    assert field[0] == pytest.approx(0.213, abs=0.01)
    assert abs(field[1]) < 0.03
    assert field[2] == pytest.approx(-0.428, abs=0.01)


def _read_field(sensors: RawSensors) -> np.ndarray:
    sensors.advance()
    return sensors.inertial(0.0).magnetic_field_in_body


def test_the_receiver_knows_where_it_is_until_it_is_blind() -> None:
    """With GNSS a 3D fix near the truth; without it no fix, and the last position."""
    sensors, estimate = sensors_at_rest()
    seen = sensors.gnss(1.0)
    latitude, longitude, altitude = geographic_position((0.0, 100.0, 2.0))
    assert (seen.fix, seen.satellites) == (3, 10)
    assert (seen.latitude_deg - latitude) * 111e3 == pytest.approx(0.0, abs=1.5)
    assert (seen.longitude_deg - longitude) * 75e3 == pytest.approx(0.0, abs=1.5)
    assert seen.altitude_m == pytest.approx(altitude, abs=2.5)
    estimate.set_gnss(False)
    sensors.advance()
    blind = sensors.gnss(2.0)
    assert (blind.fix, blind.satellites, blind.horizontal_accuracy_m) == (0, 0, 100.0)
    assert blind.latitude_deg == seen.latitude_deg


def test_geography() -> None:
    """A hundred metres north are 0.0009 degrees of latitude; east they are more of longitude."""
    latitude, longitude, altitude = geographic_position((0.0, 0.0, 0.0))
    assert (latitude, longitude, altitude) == (47.397742, 8.545594, 489.4)
    assert geographic_position((0.0, 100.0, 0.0))[0] - latitude == pytest.approx(100.0 / 6371000.0 * 180.0 / math.pi)
    east = geographic_position((100.0, 0.0, 0.0))[1] - longitude
    assert east == pytest.approx(100.0 / 6371000.0 * 180.0 / math.pi / math.cos(math.radians(47.397742)))


def test_reading_twice_gives_the_same() -> None:
    """Two readings in a step are one measurement."""
    sensors, _ = sensors_at_rest()
    assert sensors.inertial(0.0).acceleration_in_body.tolist() == sensors.inertial(0.0).acceleration_in_body.tolist()
    assert sensors.gnss(0.0).latitude_deg == sensors.gnss(0.0).latitude_deg


def test_noise_does_not_depend_on_who_has_read_before() -> None:
    """After the same number of steps the reading is the same, whether every step was read or none."""
    watched, _ = sensors_at_rest()
    unwatched, _ = sensors_at_rest()
    for _ in range(600):
        watched.advance()
        unwatched.advance()
        watched.inertial(0.0)
    assert watched.inertial(0.0).acceleration_in_body.tolist() == unwatched.inertial(0.0).acceleration_in_body.tolist()
