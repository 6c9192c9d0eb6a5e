"""HIGHRES_IMU as samples of the accelerometer: the mean of all readings that have come since the last look.

PX4 puts the latest integral of its inertial unit into each message (5 ms of acceleration at IMU_INTEG_RATE 200), less
the bias that its estimator knows. Rotors shake it with 0.4 to 3 m/s^2 at 40 to 110 Hz (flight logs of five vehicles),
and every fourth integral alone, PX4's default of 50 Hz, takes that for slow motion. The mean of consecutive integrals
is what the velocity really changed by: 0.1 to 0.5 m/s^2 is left of the shaking.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from uasfly.frames import swap_flu_frd
from uasfly.link.clock import ClockMap
from uasfly.link.slots import Slot
from uasfly.messages import AccelerometerSample

NAME = "HIGHRES_IMU"
_MICRO = 1e-6


def taken(slot: Slot) -> list[tuple[float, str]]:
    """What waits in a slot, as arrival [s] and JSON; readings of the inertial unit as one list, at their mean arrival.

    So their mean lies among the other messages where it belongs in time.
    """
    waiting = slot.take()
    if slot.name != NAME or not waiting:
        return waiting
    arrival_s = sum(arrival for arrival, _ in waiting) / len(waiting)
    return [(arrival_s, "[" + ",".join(text for _, text in waiting) + "]")]


def accelerometer_sample(
    readings: list[dict[str, Any]], clock: ClockMap, arrival_s: float
) -> tuple[AccelerometerSample | None, int]:
    """The mean of the readings (fields of HIGHRES_IMU), FRD to FLU; None where none can be used, and how many cannot.

    Args:
        readings: of one or more inertial units; those of the first one count.
        clock: maps the vehicle's time stamps to host time.
        arrival_s: mean host time of their arrival.
    """
    unit = readings[0].get("id")
    used, unusable = [], 0
    for reading in readings:
        numbers = (reading["time_usec"], reading["xacc"], reading["yacc"], reading["zacc"])
        if None in numbers or not math.isfinite(sum(numbers)):
            unusable += 1
        elif reading.get("id") == unit:
            used.append(numbers)
    if not used:
        return None, unusable
    time_us, x, y, z = (sum(column) / len(used) for column in zip(*used, strict=True))
    force = swap_flu_frd(np.array((x, y, z), dtype=np.float64))
    return AccelerometerSample(clock.to_host(time_us * _MICRO, arrival_s), force), unusable
