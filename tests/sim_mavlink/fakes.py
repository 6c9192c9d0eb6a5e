# ruff: noqa: D102
"""A vehicle of a few lines, so that the server's rules are tested without the simulation's physics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from uasfly.frames import quaternion_from_euler
from uasfly.messages import (
    Array,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    OdometrySample,
    RotorSample,
    TextSample,
    TruthSample,
    VehicleSample,
)
from uasfly.sim.faults import Fault
from uasfly.sim.link_faults import LinkFaults
from uasfly.sim.sensors import GnssSample, InertialSample

YAW_RAD = 0.3


class FakeVehicle:
    """Stands still, does what it is told, and keeps a record of it."""

    step_s = 0.004

    def __init__(self) -> None:
        self.time_s = 0.0
        self.parameters: dict[str, Any] = {
            "COM_OF_LOSS_T": (float, 1.0),
            "COM_OBL_RC_ACT": (int, 5),
            "MAV_SYS_ID": (int, 1),
            "MIS_TAKEOFF_ALT": (float, 2.5),
            "NAV_DLL_ACT": (int, -3),
        }
        self.mode = FlightMode.HOLD
        self.armed = False
        self.in_air = False
        self.gnss_available = True
        self.position = np.array((1.0, 2.0, 3.0))
        self.velocity = np.array((0.1, 0.2, 0.3))
        self.quaternion = quaternion_from_euler(0.0, 0.0, YAW_RAD)
        self.targets: list[tuple[Array, float, float | None]] = []
        self.takeoff_height_m = math.nan
        self.refusal = ""
        self.texts: list[TextSample] = []
        self.boots = 1
        self.link_faults = LinkFaults(np.random.default_rng(0))
        self.injected: list[Fault] = []
        self.rotor_speeds: Array | None = None

    def inject(self, fault: Fault) -> None:
        self.injected.append(fault)

    def advance_to(self, time_s: float) -> None:
        self.time_s = round(time_s / self.step_s) * self.step_s

    def set_attitude_target(self, quaternion: Array, thrust: float, yaw_rate_rad_s: float | None) -> None:
        self.targets.append((quaternion, thrust, yaw_rate_rad_s))

    def set_mode(self, mode: FlightMode) -> tuple[bool, str]:
        if not self._refused():
            self.mode = mode
        return not self.refusal, self.refusal

    def set_takeoff_height(self, height_m: float) -> None:
        self.takeoff_height_m = height_m

    def set_gnss(self, available: bool) -> None:
        self.gnss_available = available

    def arm(self) -> tuple[bool, str]:
        self.armed = not self._refused()
        return self.armed, self.refusal

    def disarm(self, forced: bool = False) -> tuple[bool, str]:
        self.armed = self.in_air and not forced
        return not self.armed, ""

    def odometry(self) -> OdometrySample:
        return OdometrySample(
            self.time_s, self.position, self.velocity, self.quaternion, np.array((0.01, 0.02, 0.03)), 3
        )

    def truth(self) -> TruthSample:
        force, wind = np.array((0.7, 0.8, 0.9)), np.array((5.0, 6.0, -1.0))
        return TruthSample(self.time_s, self.position + 0.5, self.velocity, self.quaternion, force, wind)

    def battery(self) -> BatterySample:
        return BatterySample(self.time_s, 15.8, 0.785)

    def state(self) -> VehicleSample:
        return VehicleSample(self.time_s, self.mode, self.armed, self.in_air)

    def health(self) -> HealthSample:
        good = self.gnss_available
        return HealthSample(self.time_s, good, good, True, 3 if good else 0, 10 if good else 0, 0.3 if good else 4.0)

    def attitude_target(self) -> AttitudeTargetSample:
        return AttitudeTargetSample(self.time_s, self.quaternion, 0.4)

    def take_texts(self) -> list[TextSample]:
        texts, self.texts = self.texts, []
        return texts

    def inertial(self) -> InertialSample:
        return InertialSample(
            self.time_s, np.array((0.1, 0.2, 9.8)), np.array((0.3, 0.4, 0.5)), np.array((0.2, 0.1, -0.4)), 489.666
        )

    def rotors(self) -> RotorSample | None:
        return None if self.rotor_speeds is None else RotorSample(self.time_s, self.rotor_speeds)

    def gnss(self) -> GnssSample:
        fix, satellites = (3, 10) if self.gnss_available else (0, 0)
        return GnssSample(self.time_s, fix, satellites, 47.5, -8.25, 492.4, self.velocity, 0.9, 1.78)

    def _refused(self) -> bool:
        if self.refusal:
            self.texts.append(TextSample(self.time_s, 2, self.refusal))
        return bool(self.refusal)
