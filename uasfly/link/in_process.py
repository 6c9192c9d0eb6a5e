"""The in-process end of the link: a simulated vehicle in the same process, with latency, deterministic.

It stands for MAVLink over a wire: samples arrive later than they were true, setpoints act later than they were sent,
the rates are those that the MAVSDK end asks PX4 for.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Protocol, TypeVar

import numpy as np

from uasfly.frames import quaternion_from_euler
from uasfly.link.encode import check_setpoint
from uasfly.messages import (
    AccelerometerSample,
    Array,
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    LinkEvent,
    LinkSample,
    OdometrySample,
    Request,
    RequestKind,
    RequestResult,
    RotorSample,
    Sample,
    Setpoint,
    TextSample,
    TruthSample,
    VehicleSample,
)
from uasfly.wind_messages import WindEstimate

ODOMETRY_RATE_HZ = 100.0
ATTITUDE_TARGET_RATE_HZ = 50.0
ACCELEROMETER_RATE_HZ = 50.0  # the MAVSDK end takes the mean of the readings of a control cycle
ROTOR_RATE_HZ = 50.0
STATE_RATE_HZ = 2.0
BATTERY_RATE_HZ = 1.0
HEALTH_RATE_HZ = 5.0
ANSWER_LATENCY_S = 0.01
SAME_CLOCK_S = 0.02  # the vehicle stops at its last whole step before a time

_MODES = {
    RequestKind.TAKEOFF: FlightMode.TAKEOFF,
    RequestKind.OFFBOARD: FlightMode.OFFBOARD,
    RequestKind.HOLD: FlightMode.HOLD,
    RequestKind.LAND: FlightMode.LAND,
    RequestKind.RETURN: FlightMode.RETURN,
}


AnySample = TypeVar("AnySample", bound=Sample)


class MessageFaults(Protocol):
    """What a bad link does to messages; see `uasfly.sim.link_faults`."""

    def telemetry(self) -> tuple[float, ...]:
        """Delays [s] of the copies of one message from the vehicle that get through."""
        ...

    def command(self, is_setpoint: bool) -> tuple[float, ...]:
        """The same for one message to the vehicle."""
        ...

    def acknowledgement(self) -> int | None:
        """A result that the next command is answered with instead of the true one."""
        ...


class DirectVehicle(Protocol):
    """What this end needs of a simulated vehicle; times are the vehicle's, which here are also the host's."""

    @property
    def time_s(self) -> float:
        """Time since boot [s]."""
        ...

    @property
    def boots(self) -> int:
        """How often it has started."""
        ...

    @property
    def condition(self) -> tuple[FlightMode, bool, bool]:
        """Mode, whether it is armed, whether it is in the air."""
        ...

    @property
    def link_faults(self) -> MessageFaults:
        """What the link does to messages now."""
        ...

    def advance_to(self, time_s: float) -> None:
        """Let the vehicle live until then."""
        ...

    def set_attitude_target(self, quaternion_body_to_world: Array, thrust: float, yaw_rate_rad_s: float | None) -> None:
        """Take an attitude and thrust setpoint."""
        ...

    def set_mode(self, mode: FlightMode) -> tuple[bool, str]:
        """Change the mode; whether it was accepted, and why not."""
        ...

    def set_takeoff_height(self, height_m: float) -> None:
        """Set how high above the ground the next take-off goes."""
        ...

    def arm(self) -> tuple[bool, str]:
        """Arm; whether it was accepted, and why not."""
        ...

    def disarm(self) -> tuple[bool, str]:
        """Disarm; whether it was accepted, and why not."""
        ...

    def odometry(self) -> OdometrySample:
        """The vehicle's own estimate, now."""
        ...

    def attitude_target(self) -> AttitudeTargetSample:
        """What the attitude controller is asked for, now."""
        ...

    def accelerometer(self) -> AccelerometerSample | None:
        """Mean of the accelerometer's last readings, now; None where it says nothing."""
        ...

    def rotors(self) -> RotorSample | None:
        """Speeds of the rotors, now; None where nobody tells them."""
        ...

    def battery(self) -> BatterySample:
        """Battery, now."""
        ...

    def state(self) -> VehicleSample:
        """Mode, arming and landed state, now."""
        ...

    def health(self) -> HealthSample:
        """Estimator and GNSS, now."""
        ...

    def truth(self) -> TruthSample:
        """The true state, now."""
        ...

    def take_texts(self) -> Sequence[TextSample]:
        """Status texts since the last call."""
        ...


class InProcessLink:
    """Link to a simulated vehicle that is advanced by this object; see `VehicleLink`."""

    def __init__(
        self,
        vehicle: DirectVehicle,
        telemetry_latency_s: float,
        command_latency_s: float,
        jitter_s: float,
        rng: np.random.Generator,
    ) -> None:
        self._vehicle = vehicle
        self._telemetry_latency_s = telemetry_latency_s
        self._command_latency_s = command_latency_s
        self._jitter_s = jitter_s
        self._rng = rng
        self._order = itertools.count()  # ties in time keep the order in which they came up
        self._arrivals: list[tuple[float, int, Sample]] = []
        self._commands: list[tuple[float, int, Setpoint | Request]] = []
        self._now_s = vehicle.time_s
        self._ahead_s = 0.0  # host time minus vehicle time: the vehicle's clock may jump, and starts anew with it
        self._boots = vehicle.boots
        self._said = vehicle.condition  # last told
        self._ticks = [
            _Tick(1.0 / ODOMETRY_RATE_HZ, vehicle.odometry),
            _Tick(1.0 / ATTITUDE_TARGET_RATE_HZ, vehicle.attitude_target),
            _Tick(1.0 / ACCELEROMETER_RATE_HZ, vehicle.accelerometer),
            _Tick(1.0 / ROTOR_RATE_HZ, vehicle.rotors),
            _Tick(1.0 / STATE_RATE_HZ, self._state),
            _Tick(1.0 / BATTERY_RATE_HZ, vehicle.battery),
            _Tick(1.0 / HEALTH_RATE_HZ, vehicle.health),
        ]

    def advance_to(self, time_s: float) -> None:
        """Let the vehicle and both directions of the wire run until `time_s`."""
        while True:
            next_tick = min(self._ticks, key=_due)
            due = min(next_tick.due_s, self._commands[0][0] if self._commands else math.inf)
            if due > time_s:
                break
            self._advance_vehicle(due)
            if self._commands and self._commands[0][0] <= next_tick.due_s:
                self._deliver(heapq.heappop(self._commands)[2])
            else:
                sample = next_tick.read()
                if sample is not None:
                    self._arrive(sample)
                next_tick.go_on()
            self._tell_changes()
            for text in self._vehicle.take_texts():
                self._arrive(text)
        self._advance_vehicle(time_s)
        self._now_s = time_s

    def poll(self) -> tuple[Sample, ...]:
        """Samples that have arrived by now, oldest arrival first."""
        arrived: list[Sample] = []
        while self._arrivals and self._arrivals[0][0] <= self._now_s:
            arrived.append(heapq.heappop(self._arrivals)[2])
        return tuple(arrived)

    def send(self, setpoint: Setpoint) -> bool:
        """Send one setpoint; it acts after the command latency. See `check_setpoint` for what is refused."""
        check_setpoint(setpoint)
        for delay_s in self._vehicle.link_faults.command(is_setpoint=True):
            due_s = self._now_s + self._command_latency() + delay_s
            heapq.heappush(self._commands, (due_s, next(self._order), setpoint))
        return True

    def send_text(self, severity: int, text: str) -> None:
        """Texts to the ground station go nowhere: a rehearsal has none."""

    def send_wind(self, wind: WindEstimate) -> None:
        """Nor does the wind."""

    def request(self, request: Request) -> None:
        """Ask the vehicle; the answer arrives as a RequestResult."""
        for delay_s in self._vehicle.link_faults.command(is_setpoint=False):
            due_s = self._now_s + self._command_latency() + delay_s
            heapq.heappush(self._commands, (due_s, next(self._order), request))

    def truth(self) -> TruthSample:
        """The true state now, on the host's clock; no link has it."""
        return self._stamped(self._vehicle.truth())

    def _advance_vehicle(self, time_s: float) -> None:
        """Let the vehicle run until a host time; its clock may jump on the way."""
        vehicle = self._vehicle
        wanted_s = time_s - self._ahead_s
        vehicle.advance_to(wanted_s)
        if not -SAME_CLOCK_S < wanted_s - vehicle.time_s < SAME_CLOCK_S:
            self._ahead_s += wanted_s - vehicle.time_s
        if vehicle.boots != self._boots:
            self._boots = vehicle.boots
            self._arrive(LinkSample(vehicle.time_s, LinkEvent.REBOOTED))

    def _state(self) -> VehicleSample:
        self._said = self._vehicle.condition
        return self._vehicle.state()

    def _tell_changes(self) -> None:
        """PX4 tells a new mode at once."""
        if self._vehicle.condition != self._said:
            self._arrive(self._state())

    def _command_latency(self) -> float:
        return self._command_latency_s + self._jitter_s * float(self._rng.random())

    def _arrive(self, sample: Sample) -> None:
        sample = self._stamped(sample)
        for delay_s in self._vehicle.link_faults.telemetry():
            latency = self._telemetry_latency_s + self._jitter_s * float(self._rng.random()) + delay_s
            due_s = self._vehicle.time_s + self._ahead_s + latency
            heapq.heappush(self._arrivals, (due_s, next(self._order), sample))

    def _stamped(self, sample: AnySample) -> AnySample:
        """The sample on the host's clock, as the MAVSDK end maps it."""
        return sample if self._ahead_s == 0.0 else replace(sample, time_s=sample.time_s + self._ahead_s)

    def _deliver(self, command: Setpoint | Request) -> None:
        vehicle = self._vehicle
        if isinstance(command, Setpoint):
            quaternion = quaternion_from_euler(command.roll_rad, command.pitch_rad, command.yaw_rad)
            vehicle.set_attitude_target(quaternion, command.thrust, command.yaw_rate_rad_s)
            return
        match command.kind:
            case RequestKind.ARM:
                accepted, text = vehicle.arm()
            case RequestKind.DISARM:
                accepted, text = vehicle.disarm()
            case _:
                if command.kind is RequestKind.TAKEOFF:
                    vehicle.set_takeoff_height(command.height_m)
                accepted, text = vehicle.set_mode(_MODES[command.kind])
        odd = vehicle.link_faults.acknowledgement()
        if odd is not None:
            accepted, text = False, f"refused with result {odd}"
        now_s = vehicle.time_s + self._ahead_s
        result = RequestResult(now_s, command, accepted, text)
        for delay_s in vehicle.link_faults.telemetry():
            heapq.heappush(self._arrivals, (now_s + ANSWER_LATENCY_S + delay_s, next(self._order), result))


class _Tick:
    """A stream with a fixed rate: when it is due next, and how to read it."""

    __slots__ = ("count", "due_s", "period_s", "read")

    def __init__(self, period_s: float, read: _Reader) -> None:
        self.period_s = period_s
        self.read = read
        self.count = 1
        self.due_s = period_s

    def go_on(self) -> None:
        self.count += 1
        self.due_s = self.count * self.period_s


class _Reader(Protocol):
    def __call__(self) -> Sample | None: ...


_due = attrgetter("due_s")
