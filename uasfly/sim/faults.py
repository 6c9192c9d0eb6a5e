"""Faults of the simulated vehicle and of its link, as scenario files name them; `fault_board` makes them happen."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from uasfly.airframe import FileModel, NonNegative, Positive
from uasfly.messages import FlightMode
from uasfly.sim.wind.settings import AirVelocity, Fraction, Vector

Direction = Literal["both", "telemetry", "commands"]
ModeName = Literal["hold", "offboard", "land", "return", "position"]


class FaultBase(FileModel):
    """When a fault begins."""

    at_s: Annotated[NonNegative, Field(description="when it begins")] = 0.0
    after: Annotated[
        Literal["offboard", "boot"], Field(description="what at_s counts from: the first offboard, or the start")
    ] = "offboard"


class Lasting(FaultBase):
    """A fault that ends."""

    duration_s: Annotated[Positive | None, Field(description="to the end when not given")] = None


class GnssLost(Lasting):
    """No GNSS: PX4 goes on by inertia, and calls its position invalid after five seconds."""

    kind: Literal["gnss_lost"]


class GnssJump(Lasting):
    """The position from GNSS is off by so much."""

    kind: Literal["gnss_jump"]
    offset_m: Vector


class GnssDrift(Lasting):
    """The position from GNSS runs away, the velocity does not; what it has drifted stays."""

    kind: Literal["gnss_drift"]
    velocity_m_s: Vector


class GnssDegraded(Lasting):
    """GNSS tells that it is poor."""

    kind: Literal["gnss_degraded"]
    accuracy_m: Positive
    satellites: Annotated[int, Field(ge=0, le=40)]


class VelocitySpike(Lasting):
    """The velocity in the telemetry is off."""

    kind: Literal["velocity_spike"]
    offset_m_s: Vector
    duration_s: Annotated[Positive | None, Field(description="to the end when null")] = 0.1


class AttitudeSpike(Lasting):
    """The attitude in the telemetry is turned by a rotation vector in the body."""

    kind: Literal["attitude_spike"]
    rotation_deg: Vector
    duration_s: Annotated[Positive | None, Field(description="to the end when null")] = 0.1


class OdometryNan(Lasting):
    """Parts of the telemetry are not finite."""

    kind: Literal["odometry_nan"]
    part: Literal["position", "velocity", "attitude", "all"]
    duration_s: Annotated[Positive | None, Field(description="to the end when null")] = 1.0


class Accelerometer(Lasting):
    """The inertial unit says nothing, or its accelerometer's numbers are not finite, or absurdly large."""

    kind: Literal["accelerometer"]
    says: Literal["nothing", "nan", "huge"]


class RotorSpeeds(Lasting):
    """The speed controllers say nothing, the same speeds again and again, or that the first rotor stands."""

    kind: Literal["rotor_speeds"]
    says: Literal["nothing", "frozen", "zero"]


class BatteryCharge(FaultBase):
    """The battery has so much charge left."""

    kind: Literal["battery"]
    charge: Fraction


class Motor(Lasting):
    """A motor gives this share of its thrust."""

    kind: Literal["motor"]
    motor: Annotated[int, Field(ge=0, le=11, description="0 is the first")]
    effectiveness: Fraction


class Wind(Lasting):
    """Wind that is added to the scenario's."""

    kind: Literal["wind"]
    velocity_m_s: Annotated[AirVelocity, Field(description="towards x east, y north, z up")]
    ramp_s: Annotated[Positive, Field(description="it rises and falls in this time")] = 1.0


class RefuseArming(Lasting):
    """The vehicle does not arm."""

    kind: Literal["refuse_arming"]


class RefuseOffboard(Lasting):
    """The vehicle does not enter offboard."""

    kind: Literal["refuse_offboard"]


class ModeSwitch(FaultBase):
    """The pilot's switch."""

    kind: Literal["mode"]
    mode: ModeName

    @property
    def flight_mode(self) -> FlightMode:
        """The mode as the vehicle knows it."""
        return FlightMode(self.mode)


class Reboot(FaultBase):
    """The autopilot starts again: motors off, clock at zero, everything forgotten that it does not keep."""

    kind: Literal["reboot"]


class ClockJump(FaultBase):
    """The autopilot's clock jumps."""

    kind: Literal["clock_jump"]
    step_s: Annotated[float, Field(ge=-5.0, le=100.0)]


class Silence(Lasting):
    """Nothing gets through."""

    kind: Literal["silence"]
    direction: Direction = "both"


class Loss(Lasting):
    """Packets are lost."""

    kind: Literal["loss"]
    share: Fraction
    direction: Direction = "both"


class Duplicates(Lasting):
    """Packets come twice."""

    kind: Literal["duplicates"]
    share: Fraction


class Reorder(Lasting):
    """Packets are overtaken by later ones."""

    kind: Literal["reorder"]
    share: Fraction
    delay_s: Annotated[float, Field(gt=0.0, le=1.0)] = 0.03


class Garbage(Lasting):
    """Random bytes between the frames of the telemetry (over MAVLink; nothing comes of them otherwise)."""

    kind: Literal["garbage"]
    rate_hz: Annotated[float, Field(gt=0.0, le=2000.0)]


class SetpointsHalved(Lasting):
    """Every second setpoint is lost."""

    kind: Literal["setpoints_halved"]


class OddAcknowledgement(FaultBase):
    """The next commands are obeyed, but answered with a result that few programs expect."""

    kind: Literal["odd_acknowledgement"]
    result: Annotated[int, Field(ge=7, le=255)] = 10
    count: Annotated[int, Field(ge=1, le=1000)] = 1


LinkFault = Silence | Loss | Duplicates | Reorder | Garbage | SetpointsHalved | OddAcknowledgement
Fault = Annotated[
    GnssLost
    | GnssJump
    | GnssDrift
    | GnssDegraded
    | VelocitySpike
    | AttitudeSpike
    | OdometryNan
    | Accelerometer
    | RotorSpeeds
    | BatteryCharge
    | Motor
    | Wind
    | RefuseArming
    | RefuseOffboard
    | ModeSwitch
    | Reboot
    | ClockJump
    | LinkFault,
    Field(discriminator="kind"),
]
