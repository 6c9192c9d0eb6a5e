"""What the MAVLink server needs of a simulated vehicle; `uasfly.sim.vehicle.SimulatedVehicle` offers it."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from typing import Protocol

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
from uasfly.sim.parameters import Parameter
from uasfly.sim.sensors import GnssSample, InertialSample


class Vehicle(Protocol):
    """A vehicle that is advanced from outside. Times are its own, in seconds since boot; world ENU, body FLU, SI units.

    Attributes:
        time_s: vehicle time of the last step.
        step_s: length of a step.
        parameters: PX4 parameters by name: type (int or float) and value.
        boots: how often it has started. link_faults: what the link does to messages.
    """

    @property
    def time_s(self) -> float: ...  # noqa: D102

    @property
    def step_s(self) -> float: ...  # noqa: D102

    @property
    def parameters(self) -> MutableMapping[str, Parameter]: ...  # noqa: D102

    @property
    def boots(self) -> int: ...  # noqa: D102

    @property
    def link_faults(self) -> LinkFaults: ...  # noqa: D102

    def inject(self, fault: Fault) -> None:
        """Let a fault begin now."""

    def advance_to(self, time_s: float) -> None:
        """Simulate until `time_s`."""

    def set_attitude_target(self, quaternion_body_to_world: Array, thrust: float, yaw_rate_rad_s: float | None) -> None:
        """Take an attitude (4,), a thrust 0..1 and a yaw rate as feed-forward, which act in offboard."""

    def set_mode(self, mode: FlightMode) -> tuple[bool, str]:
        """Ask for a mode; whether it was granted, and why not."""
        ...

    def set_takeoff_height(self, height_m: float) -> None:
        """Set the height above the ground that the next take-off climbs to."""

    def set_gnss(self, available: bool) -> None:
        """Take the GNSS away or give it back."""

    def arm(self) -> tuple[bool, str]:
        """Ask to arm; whether it was granted, and why not."""
        ...

    def disarm(self, forced: bool = False) -> tuple[bool, str]:
        """Ask to disarm, in the air only when `forced`; whether it was granted, and why not."""
        ...

    def odometry(self) -> OdometrySample:
        """The estimate of position, velocity, attitude and rates."""
        ...

    def truth(self) -> TruthSample:
        """The true state."""
        ...

    def battery(self) -> BatterySample:
        """Voltage and charge."""
        ...

    def state(self) -> VehicleSample:
        """Mode, arming and landed state."""
        ...

    def health(self) -> HealthSample:
        """Estimator and GNSS."""
        ...

    def attitude_target(self) -> AttitudeTargetSample:
        """What the attitude controller is asked for."""
        ...

    def inertial(self) -> InertialSample | None:
        """Accelerometer, gyro, magnetometer and barometer; None where they say nothing."""
        ...

    def rotors(self) -> RotorSample | None:
        """Speeds of the rotors; None where nobody tells them."""
        ...

    def gnss(self) -> GnssSample:
        """GNSS receiver."""
        ...

    def take_texts(self) -> Sequence[TextSample]:
        """Status texts since the last call."""
        ...
