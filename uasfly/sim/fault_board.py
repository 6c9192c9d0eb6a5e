"""Makes faults happen to a vehicle: at their time, or at once, and undone when they end."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np

from uasfly.errors import UasflyError
from uasfly.frames import quaternion_from_rotation_vector, quaternion_product
from uasfly.messages import AccelerometerSample, Array, FlightMode, OdometrySample, RotorSample
from uasfly.sim import faults as f
from uasfly.sim.link_faults import LinkFaults

Vector = tuple[float, float, float]

_HUGE_M_S2 = 1e30


class FaultyVehicle(Protocol):
    """What can be done to a vehicle."""

    def set_gnss(self, available: bool) -> None: ...  # noqa: D102
    def set_gnss_offset(self, offset_in_world: Vector) -> None: ...  # noqa: D102
    def set_gnss_quality(self, quality: tuple[float, int] | None) -> None: ...  # noqa: D102
    def set_motor_effectiveness(self, motor: int, effectiveness: float) -> None: ...  # noqa: D102
    def set_battery_charge(self, charge: float) -> None: ...  # noqa: D102
    def set_mode(self, mode: FlightMode) -> tuple[bool, str]: ...  # noqa: D102
    def refuse(self, arming: bool, offboard: bool) -> None: ...  # noqa: D102
    def reboot(self) -> None: ...  # noqa: D102
    def jump_clock(self, step_s: float) -> None: ...  # noqa: D102


class FaultBoard:
    """All faults of one vehicle; times are those of the simulation, which no fault moves.

    Args:
        vehicle: what they happen to.
        scheduled: faults that begin by themselves.
        rng: for the link's faults.

    Attributes:
        link: faults of the link.
        wind: (3,) m/s that is added to the wind now.
        distorts: whether telemetry is being distorted.
    """

    def __init__(self, vehicle: FaultyVehicle, scheduled: tuple[f.Fault, ...], rng: np.random.Generator) -> None:
        self.link = LinkFaults(rng)
        self.wind: Vector = (0.0, 0.0, 0.0)
        self.distorts = False
        self._vehicle = vehicle
        self._waiting = sorted(scheduled, key=lambda fault: fault.at_s)
        self._ends: list[tuple[float, Callable[[], None]]] = []
        self._offset = [0.0, 0.0, 0.0]
        self._drifts: list[f.GnssDrift] = []
        self._gusts: list[tuple[f.Wind, float, float]] = []  # with begin and end
        self._accelerometer: list[f.Accelerometer] = []
        self._rotor_speeds: list[f.RotorSpeeds] = []
        self._frozen: Array | None = None  # the speeds that are told again and again
        self._distortions: list[f.VelocitySpike | f.AttitudeSpike | f.OdometryNan] = []
        self._refuses = [0, 0]
        self._now_s = 0.0

    @property
    def idle(self) -> bool:
        """Whether nothing is active or awaited."""
        return not (self._waiting or self._ends or self._drifts or self._gusts)

    def update(self, now_s: float, engaged_s: float | None) -> None:
        """Begin and end what is due; call it some twenty times a second.

        Args:
            now_s: time of the simulation.
            engaged_s: when offboard first began, None before.
        """
        elapsed, self._now_s = now_s - self._now_s, now_s
        due = [fault for fault in self._waiting if _begins_s(fault, engaged_s) <= now_s]
        for fault in due:
            self._waiting.remove(fault)
            self.begin(fault)
        for end_s, undo in list(self._ends):
            if now_s >= end_s:
                self._ends.remove((end_s, undo))
                undo()
        if self._drifts:
            for drift in self._drifts:
                self._shift(tuple(v * elapsed for v in drift.velocity_m_s))
        if self._gusts:
            self._blow(now_s)

    def begin(self, fault: f.Fault) -> None:
        """Let a fault begin now, whenever it was meant to."""
        undo = self._begin_gnss(fault) or self._begin_vehicle(fault)
        if isinstance(fault, f.LinkFault):
            self.link.begin(fault)
            undo = partial(self.link.end, fault)
        if undo is not None and isinstance(fault, f.Lasting) and fault.duration_s is not None:
            self._ends.append((self._now_s + fault.duration_s, undo))

    def _begin_gnss(self, fault: f.Fault) -> Callable[[], None] | None:
        """Faults of position and telemetry; how they are undone."""
        vehicle = self._vehicle
        match fault:
            case f.GnssLost():
                vehicle.set_gnss(False)
                return partial(vehicle.set_gnss, True)
            case f.GnssJump():
                self._shift(fault.offset_m)
                return partial(self._shift, tuple(-v for v in fault.offset_m))
            case f.GnssDrift():
                self._drifts.append(fault)
                return partial(self._drifts.remove, fault)
            case f.GnssDegraded():
                vehicle.set_gnss_quality((fault.accuracy_m, fault.satellites))
                return partial(vehicle.set_gnss_quality, None)
            case f.VelocitySpike() | f.AttitudeSpike() | f.OdometryNan():
                self._distort(fault, begins=True)
                return partial(self._distort, fault, begins=False)
        return None

    def _begin_vehicle(self, fault: f.Fault) -> Callable[[], None] | None:
        """Faults of the vehicle and of what is around it; how they are undone."""
        vehicle = self._vehicle
        match fault:
            case f.BatteryCharge():
                vehicle.set_battery_charge(fault.charge)
            case f.Motor():
                vehicle.set_motor_effectiveness(fault.motor, fault.effectiveness)
                return partial(vehicle.set_motor_effectiveness, fault.motor, 1.0)
            case f.Wind():
                end_s = math.inf if fault.duration_s is None else self._now_s + fault.duration_s
                self._gusts.append((fault, self._now_s, end_s))
            case f.Accelerometer():
                self._accelerometer.append(fault)
                return partial(self._accelerometer.remove, fault)
            case f.RotorSpeeds():
                self._rotor_speeds.append(fault)
                return partial(self._rotor_speeds.remove, fault)
            case f.RefuseArming() | f.RefuseOffboard():
                index = int(isinstance(fault, f.RefuseOffboard))
                self._refuse(index, 1)
                return partial(self._refuse, index, -1)
            case f.ModeSwitch():
                vehicle.set_mode(fault.flight_mode)
            case f.Reboot():
                vehicle.reboot()
            case f.ClockJump():
                vehicle.jump_clock(fault.step_s)
        return None

    def distorted(self, sample: OdometrySample) -> OdometrySample:
        """The sample as the telemetry gives it."""
        position, velocity = sample.position_in_world, sample.velocity_in_world
        quaternion = sample.quaternion_body_to_world
        for fault in self._distortions:
            match fault:
                case f.VelocitySpike():
                    velocity = velocity + np.array(fault.offset_m_s)
                case f.AttitudeSpike():
                    turned = quaternion_from_rotation_vector(np.radians(fault.rotation_deg))
                    quaternion = quaternion_product(quaternion, turned)
                case f.OdometryNan():
                    unknown = np.full(3, math.nan)
                    position = unknown if fault.part in ("position", "all") else position
                    velocity = unknown if fault.part in ("velocity", "all") else velocity
                    quaternion = np.full(4, math.nan) if fault.part in ("attitude", "all") else quaternion
        return replace(
            sample, position_in_world=position, velocity_in_world=velocity, quaternion_body_to_world=quaternion
        )

    def accelerometer(self, sample: AccelerometerSample) -> AccelerometerSample | None:
        """What the telemetry gives of a sample of the accelerometer, if anything."""
        if not self._accelerometer:
            return sample
        said = self._accelerometer[-1].says
        if said == "nothing":
            return None
        return AccelerometerSample(sample.time_s, np.full(3, math.nan if said == "nan" else _HUGE_M_S2))

    def rotors(self, sample: RotorSample) -> RotorSample | None:
        """What the telemetry gives of the rotors' speeds, if anything."""
        said = self._rotor_speeds[-1].says if self._rotor_speeds else ""
        if said != "frozen" or self._frozen is None:
            self._frozen = sample.speeds_rad_s
        if said == "nothing":
            return None
        if said == "zero":
            return RotorSample(sample.time_s, np.concatenate((np.zeros(1), sample.speeds_rad_s[1:])))
        return RotorSample(sample.time_s, self._frozen)

    def _shift(self, step: tuple[float, ...]) -> None:
        self._offset = [old + s for old, s in zip(self._offset, step, strict=True)]
        x, y, z = self._offset
        self._vehicle.set_gnss_offset((x, y, z))

    def _distort(self, fault: f.VelocitySpike | f.AttitudeSpike | f.OdometryNan, begins: bool) -> None:
        (self._distortions.append if begins else self._distortions.remove)(fault)
        self.distorts = bool(self._distortions)

    def _refuse(self, index: int, step: int) -> None:
        self._refuses[index] += step
        self._vehicle.refuse(self._refuses[0] > 0, self._refuses[1] > 0)

    def _blow(self, now_s: float) -> None:
        total = np.zeros(3)
        for item in list(self._gusts):
            gust, begin_s, end_s = item
            rising, falling = (now_s - begin_s) / gust.ramp_s, (now_s - end_s) / gust.ramp_s
            if falling >= 1.0:
                self._gusts.remove(item)
            total += np.array(gust.velocity_m_s) * (_smooth(rising) - _smooth(falling))
        self.wind = float(total[0]), float(total[1]), float(total[2])


def check_motors(faults: tuple[f.Fault, ...], rotors: int) -> None:
    """Refuse a fault of a motor that the vehicle does not have.

    Raises:
        UasflyError: naming the fault and the motors that there are.
    """
    for index, fault in enumerate(faults):
        if isinstance(fault, f.Motor) and fault.motor >= rotors:
            raise UasflyError(f"faults[{index}].motor: expected 0 to {rotors - 1} on this vehicle, found {fault.motor}")


def _begins_s(fault: f.Fault, engaged_s: float | None) -> float:
    if fault.after == "boot":
        return fault.at_s
    return math.inf if engaged_s is None else engaged_s + fault.at_s


def _smooth(share: float) -> float:
    """0 before 0, 1 after 1, without a kink in between."""
    u = min(1.0, max(0.0, share))
    return u * u * (3.0 - 2.0 * u)
