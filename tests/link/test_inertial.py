"""HIGHRES_IMU: the mean of what has come."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from uasfly.link.clock import ClockMap
from uasfly.link.decoder import Decoder
from uasfly.link.inertial import accelerometer_sample, taken
from uasfly.link.slots import Slot
from uasfly.messages import AccelerometerSample


def reading(time_s: float, x: float | None, y: float = -0.2, z: float = -9.8, unit: int = 0) -> dict[str, Any]:
    """Fields of a message, in FRD; None is what NaN arrives as."""
    return {"time_usec": round(time_s * 1e6), "xacc": x, "yacc": y, "zacc": z, "id": unit}


def test_readings_become_their_mean_in_flu() -> None:
    """Forward stays, right becomes left, down becomes up; the time is the middle of theirs."""
    sample, unusable = accelerometer_sample([reading(4.0, 0.1), reading(4.01, 0.3)], ClockMap(), 104.0)
    assert sample is not None
    assert unusable == 0
    np.testing.assert_allclose(sample.specific_force_in_body, (0.2, 0.2, 9.8))
    assert sample.time_s == ClockMap().to_host(4.005, 104.0)


def test_readings_without_a_number_and_of_other_units_stay_out() -> None:
    """What is left counts; of nothing there is no sample."""
    mixed = [reading(4.0, 0.1), reading(4.01, None), reading(4.02, 9.0, unit=1)]
    sample, unusable = accelerometer_sample(mixed, ClockMap(), 104.0)
    assert sample is not None
    assert sample.specific_force_in_body[0] == 0.1
    assert unusable == 1
    assert accelerometer_sample([reading(4.0, None)], ClockMap(), 104.0) == (None, 1)


def test_what_waits_comes_as_one_message_among_the_others() -> None:
    """Four readings between two odometry messages lie between them; other messages stay single."""
    inertial, odometry = Slot("HIGHRES_IMU", 32), Slot("ODOMETRY", 16)
    for k in range(4):
        inertial.put(1.001 + 0.005 * k, json.dumps(reading(4.0 + 0.005 * k, 0.1 * k)))
    odometry.put(1.0, "{}")
    odometry.put(1.01, "{}")
    assert len(taken(odometry)) == 2
    ((arrival_s, text),) = taken(inertial)
    assert 1.0 < arrival_s < 1.01
    sample = Decoder(ClockMap()).decode("HIGHRES_IMU", text, arrival_s)
    assert isinstance(sample, AccelerometerSample)
    assert sample.specific_force_in_body[0] == pytest.approx(0.15)
    assert taken(inertial) == []


def test_a_message_alone_is_taken_and_a_malformed_one_counted() -> None:
    """Neither ends the flight."""
    decoder = Decoder(ClockMap())
    assert isinstance(decoder.decode("HIGHRES_IMU", json.dumps(reading(4.0, 0.1)), 104.0), AccelerometerSample)
    assert decoder.decode("HIGHRES_IMU", '[{"time_usec": 1}]', 104.0) is None
    assert decoder.decode("HIGHRES_IMU", json.dumps([reading(4.0, None)]), 104.0) is None
    assert decoder.dropped["HIGHRES_IMU"] == 2
