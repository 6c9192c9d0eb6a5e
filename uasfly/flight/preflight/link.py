"""Rates, age and losses of what arrives."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.preflight_messages import PreflightCheck

LEAST_IN_TIME = 2.0  # samples within the time after which telemetry counts as silent: one may be lost
TARGET_LEAST_HZ = 5.0  # the echo until offboard wants a target younger than half a second
SLOW_ROUND_TRIP_S = 0.05  # as long as the whole delay of command_delay_s in the shipped airframe files

_ODOMETRY = Subject(
    "odometry rate", "the observer corrects itself with each ODOMETRY; a silent one stops the setpoints"
)
_TARGET = Subject("target rate", "until offboard uasfly repeats what PX4 asks of its attitude controller")
_AGE = Subject("latency", "the state is predicted over its own age: an old one is a worse one")
_ROUND_TRIP = Subject("round trip", "TIMESYNC dates the samples; half of it is how late a setpoint arrives")
_LOSSES = Subject("losses", "what is lost or cannot be read makes gaps")


def link_checks(gathered: Gathered) -> Iterator[PreflightCheck]:
    """All checks of this file."""
    yield _odometry(gathered)
    yield _target(gathered)
    yield _age(gathered)
    yield _round_trip(gathered)
    yield _losses(gathered)


def _odometry(gathered: Gathered) -> PreflightCheck:
    rate = gathered.rate_hz("ODOMETRY")
    if rate is None:
        return _ODOMETRY.warning("not measured", "look at the rates of the link in a ground station")
    value, wanted = f"{rate:.0f} Hz", gathered.airframe.controller.rate_hz
    remedy = "raise the link's rate: a faster baud rate (SER_TEL2_BAUD) or MAV_1_RATE, MAV_1_MODE onboard"
    if rate < LEAST_IN_TIME / gathered.mission.monitors.telemetry.stale_s:
        return _ODOMETRY.stop(value, remedy)
    if rate < 0.9 * wanted:
        return _ODOMETRY.warning(f"{value}, the controller runs at {wanted:g} Hz", remedy)
    return _ODOMETRY.ok(value)


def _target(gathered: Gathered) -> PreflightCheck:
    rate = gathered.rate_hz("ATTITUDE_TARGET")
    if rate is None:
        return _TARGET.warning("not measured", "look at the rates of the link in a ground station")
    if rate < TARGET_LEAST_HZ:
        return _TARGET.warning(
            f"{rate:.0f} Hz", "have ATTITUDE_TARGET sent; without it the switch to offboard may bump"
        )
    return _TARGET.ok(f"{rate:.0f} Hz")


def _age(gathered: Gathered) -> PreflightCheck:
    ages = [age for age in gathered.ages_s if math.isfinite(age)]
    if not ages:
        return _AGE.warning("not measured", "see that ODOMETRY arrives")
    median, late = np.percentile(ages, (50.0, 95.0)).tolist()
    value = f"{median * 1e3:.0f} ms, 95 % within {late * 1e3:.0f} ms"
    stale_s = gathered.mission.monitors.telemetry.stale_s
    remedy = "use a faster link, or a computer with less to do"
    if late > stale_s:
        return _AGE.stop(value, remedy)
    return _AGE.warning(value, remedy) if late > 0.5 * stale_s else _AGE.ok(value)


def _round_trip(gathered: Gathered) -> PreflightCheck:
    if gathered.facts is None or math.isnan(gathered.facts.round_trip_s):
        return _ROUND_TRIP.warning("TIMESYNC is not answered", "samples carry the time of their arrival: use PX4 1.11+")
    round_trip_s = gathered.facts.round_trip_s
    value = f"{round_trip_s * 1e3:.1f} ms"
    remedy = "use a cable or a local network; model.command_delay_s of the airframe file includes half of it"
    if round_trip_s > gathered.mission.monitors.telemetry.stale_s:
        return _ROUND_TRIP.stop(value, remedy)
    return _ROUND_TRIP.warning(value, remedy) if round_trip_s > SLOW_ROUND_TRIP_S else _ROUND_TRIP.ok(value)


def _losses(gathered: Gathered) -> PreflightCheck:
    facts = gathered.facts
    if facts is None:
        return _LOSSES.warning("not measured", "look at the losses of the link in a ground station")
    lost = [f"{entry.value:.0f} {entry.name}" for entry in facts.losses if entry.value > 0.0]
    if lost:
        return _LOSSES.warning(", ".join(lost), "use a better link, or a computer with less to do")
    return _LOSSES.ok("none")
