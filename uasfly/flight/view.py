"""The newest of what the vehicle has said: the sequencer and the monitors look here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from uasfly.messages import (
    AttitudeTargetSample,
    BatterySample,
    FlightMode,
    HealthSample,
    LinkEvent,
    LinkSample,
    OdometrySample,
    RequestResult,
    Sample,
    TextSample,
    VehicleSample,
)


@dataclass(slots=True)
class VehicleView:
    """Last sample of each kind to arrive, and the answers and texts that came with the last step.

    Attributes:
        odometry: the last that can be flown by: attitude and velocity are numbers.
        rebooted: the vehicle has started again since the last step.
    """

    odometry: OdometrySample | None = None
    vehicle: VehicleSample | None = None
    battery: BatterySample | None = None
    health: HealthSample | None = None
    attitude_target: AttitudeTargetSample | None = None
    rebooted: bool = False
    results: list[RequestResult] = field(default_factory=list)
    texts: list[TextSample] = field(default_factory=list)

    def update(self, samples: tuple[Sample, ...]) -> None:
        """Take in a step's samples; results and texts are those of this step only."""
        self.results.clear()
        self.texts.clear()
        self.rebooted = False
        for sample in samples:
            match sample:
                case OdometrySample():
                    if _is_usable(sample):
                        self.odometry = sample
                case VehicleSample():
                    self.vehicle = sample
                case AttitudeTargetSample():
                    self.attitude_target = sample
                case BatterySample():
                    self.battery = sample
                case HealthSample():
                    self.health = sample
                case RequestResult():
                    self.results.append(sample)
                case TextSample():
                    self.texts.append(sample)
                case LinkSample():
                    self.rebooted |= sample.event is LinkEvent.REBOOTED

    def odometry_age_s(self, time_s: float) -> float:
        """Age of the last odometry, infinite before the first; one from the future is as wrong as one from the past."""
        return math.inf if self.odometry is None else abs(time_s - self.odometry.time_s)

    @property
    def heartbeat_s(self) -> float:
        """Time of the last heartbeat, NaN before the first."""
        return math.nan if self.vehicle is None else self.vehicle.time_s

    @property
    def in_air(self) -> bool:
        """Whether the vehicle says that it flies."""
        return self.vehicle is not None and self.vehicle.in_air

    @property
    def armed(self) -> bool:
        """Whether the vehicle says that it is armed."""
        return self.vehicle is not None and self.vehicle.armed

    @property
    def mode(self) -> FlightMode:
        """The vehicle's mode, OTHER before the first heartbeat."""
        return FlightMode.OTHER if self.vehicle is None else self.vehicle.mode

    @property
    def voltage_v(self) -> float | None:
        """Battery voltage, None while unknown."""
        if self.battery is None or not math.isfinite(self.battery.voltage_v) or self.battery.voltage_v <= 0.0:
            return None
        return self.battery.voltage_v


def _is_usable(sample: OdometrySample) -> bool:
    return all(map(math.isfinite, (*sample.quaternion_body_to_world.tolist(), *sample.velocity_in_world.tolist())))
