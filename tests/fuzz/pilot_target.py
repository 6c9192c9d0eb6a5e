"""Samples into the pilot in flight: whatever comes, no setpoint leaves that is not finite or beyond the limits."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from tests.fuzz import frames
from tests.fuzz.harness import FindingError, Rng
from tests.fuzz.odd import choice
from uasfly.drivers.plan import FlightPlan, build_pilot, load_plan
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.link.encode import check_setpoint
from uasfly.messages import (
    AccelerometerSample,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    LinkEvent,
    LinkSample,
    OdometrySample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    RotorSample,
    Sample,
    TextSample,
    VehicleSample,
)

PERIOD_S = 0.02
ROUNDING = 1e-9
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
UP = np.array((0.0, 0.0, 2.0))
PATIENCE_CYCLES = 500


@cache
def plan(controller: str) -> FlightPlan:
    """A hover that does not end by itself."""
    settings = ["mission.legs[0].duration_s=3600"]
    return load_plan("hover", "f550", controller=controller, settings=settings)


class PilotSession:
    """A pilot who flies a vehicle that hangs still; some samples of each cycle are odd."""

    def __init__(self, rng: Rng) -> None:
        self._plan = plan("nmpc" if rng.random() < 0.5 else "pid")
        self._time_s = 100.0
        self._calm = False
        self._pilot = self._in_legs()

    def feed(self, rng: Rng) -> bool:
        """One cycle."""
        if self._pilot.done:
            self._pilot = self._in_legs()
        samples = self._good()
        for _ in range(int(rng.integers(4)) if rng.random() < 0.7 else 0):
            samples.append(_odd_sample(rng, self._time_s))
        if rng.random() < 0.1:
            samples = samples[1:]
        if rng.random() < 0.2:
            samples = [samples[int(at)] for at in rng.permutation(len(samples))]
        self._step(samples, PERIOD_S if rng.random() < 0.97 else float(choice(rng, (0.0, 1e-6, 0.3, 2.0, 30.0))))
        return self._pilot.sequencer.phase is Phase.LEGS

    def close(self) -> None:
        """A pilot goes on for a while on good samples alone."""
        for _ in range(100):
            self._step(self._good(), PERIOD_S)

    def _in_legs(self) -> Pilot:
        """A pilot who has met a vehicle in the air that is in offboard already."""
        self._pilot = build_pilot(self._plan, Engage.PILOT, None, late_counts=False)
        for _ in range(PATIENCE_CYCLES):
            self._step(self._good(), PERIOD_S)
            if self._pilot.sequencer.phase is Phase.LEGS:
                return self._pilot
        raise FindingError(f"no flight begins: {self._pilot.sequencer.phase} {self._pilot.sequencer.reason}")

    def _good(self) -> list[Sample]:
        now = self._time_s
        mode = FlightMode.OFFBOARD if self._pilot.sequencer.phase in (Phase.ENGAGE, Phase.LEGS) else FlightMode.HOLD
        zero = np.zeros(3)
        return [
            *(OdometrySample(now - age, UP, zero, LEVEL, zero) for age in (0.012, 0.002)),
            VehicleSample(now, mode, True, True),
            AccelerometerSample(now - 0.01, np.array((0.0, 0.0, 9.8))),
            RotorSample(now - 0.01, 509.5 + 0.1 * np.sin(1e3 * now + np.arange(6.0))),
            AttitudeTargetSample(now, LEVEL, 0.35),
            HealthSample(now, True, True, True, 3, 12, 0.3),
            BatterySample(now, 15.8, 0.9),
        ]

    def _step(self, samples: list[Sample], period_s: float) -> None:
        self._time_s += period_s
        result = self._pilot.step(self._time_s, tuple(samples))
        setpoint, limits = result.setpoint, self._plan.airframe.limits
        if setpoint is None:
            return
        try:
            check_setpoint(setpoint)
        except ValueError as error:
            raise FindingError(str(error)) from None
        tilt = max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad))
        within = limits.thrust_min - ROUNDING <= setpoint.thrust <= limits.thrust_max + ROUNDING
        rate = abs(setpoint.yaw_rate_rad_s) <= limits.yaw_rate_rad_s + ROUNDING
        if tilt > limits.tilt_rad + ROUNDING or not within or not rate or setpoint.time_s != self._time_s:
            raise FindingError(f"a setpoint beyond the limits: {setpoint}")


def _odd_sample(rng: Rng, now_s: float) -> Sample:
    time_s = choice(
        rng, (now_s, now_s, now_s, now_s - 0.05, now_s - 3.0, now_s + 0.1, now_s + 1e6, math.nan, math.inf, -1e9)
    )

    def number() -> float:
        return float(frames.number(rng, "f"))

    def vector(size: int = 3) -> Any:
        return np.array([number() for _ in range(size)])

    def attitude() -> Any:
        made = rng.normal(size=4)
        return made / np.linalg.norm(made) if rng.random() < 0.7 else vector(4)

    kind = rng.integers(11)
    if kind < 3:
        good = OdometrySample(time_s, UP, np.zeros(3), LEVEL, np.zeros(3), int(rng.integers(3)))
        part = rng.integers(6)
        if part == 0:
            return replace(good, position_in_world=vector())
        if part == 1:
            return replace(good, velocity_in_world=vector())
        if part == 2:
            return replace(good, quaternion_body_to_world=attitude())
        if part == 3:
            return replace(good, angular_rate_in_body=vector())
        if part == 4:
            return OdometrySample(time_s, vector(), vector(), attitude(), vector(), int(rng.integers(256)))
        return good
    if kind == 3:
        return AttitudeTargetSample(time_s, attitude(), number())
    if kind == 4:
        return BatterySample(time_s, number(), number())
    if kind == 5:
        mode = FlightMode.OFFBOARD if rng.random() < 0.9 else choice(rng, list(FlightMode))
        return VehicleSample(time_s, mode, rng.random() < 0.95, rng.random() < 0.95)
    if kind == 6:
        position, velocity, attitude_ok = (bool(rng.random() < 0.9) for _ in range(3))
        fix, satellites = int(rng.integers(256)), int(rng.integers(256))
        return HealthSample(time_s, position, velocity, attitude_ok, fix, satellites, number())
    if kind == 7:
        return TextSample(time_s, int(rng.integers(-3, 300)), choice(rng, ("", "x", "\x1b[2J", "é" * 300)))
    if kind in (8, 9):
        rotors = kind == 9
        return RotorSample(time_s, vector(int(rng.integers(9)))) if rotors else AccelerometerSample(time_s, vector())
    request = Request(choice(rng, list(RequestKind)), number())
    rebooted = LinkSample(time_s, LinkEvent.REBOOTED)
    return rebooted if rng.random() < 0.05 else RequestResult(time_s, request, bool(rng.integers(2)), "odd")
