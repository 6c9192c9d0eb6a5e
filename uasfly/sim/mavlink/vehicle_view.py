"""What the streams read: the vehicle's samples at one instant, in PX4's frames, worked out once for all messages."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.frames import euler_from_quaternion, swap_enu_ned, swap_flu_frd, swap_quaternion_enu_ned
from uasfly.messages import Array, FlightMode, HealthSample
from uasfly.sim.commander import READY_S
from uasfly.sim.estimate import PROBATION_S
from uasfly.sim.mavlink.vehicle_protocol import Vehicle

DEFAULT_OFFBOARD_LOSS_S = 1.0
DEFAULT_CRITICAL_CHARGE = 0.07
GNSS_FIX = 3
GNSS_STOP_S = 7.0  # without GNSS until the estimator counts on it no more (recording: 7.0 to 7.2 s)
# modes that PX4 does not arm in; Position needs a remote control
CANNOT_START = frozenset(
    {FlightMode.LAND, FlightMode.RETURN, FlightMode.DESCEND, FlightMode.POSITION, FlightMode.OTHER}
)


@dataclass(frozen=True, slots=True)
class Motion:
    """The estimate of the vehicle's motion in NED and FRD.

    Attributes:
        time_s: vehicle time of the sample.
        position_m, velocity_m_s: north, east, down.
        quaternion: body FRD to NED, w first.
        rates_rad_s: body FRD.
        euler_rad: roll, pitch, yaw (Z-Y-X).
        reset_counter: as in the sample.
    """

    time_s: float
    position_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    rates_rad_s: tuple[float, float, float]
    euler_rad: tuple[float, float, float]
    reset_counter: int

    @property
    def heading_deg(self) -> float:
        """Compass heading, 0..360, clockwise from north."""
        return math.degrees(self.euler_rad[2]) % 360.0


@dataclass(frozen=True, slots=True)
class Home:
    """Where the vehicle was armed: NED position, attitude and vehicle time."""

    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    time_s: float


class VehicleView:
    """Cached reading of a vehicle, with what PX4 derives from it: home, intended mode, failsafe.

    Attributes:
        intended_mode: mode that was last asked for; PX4 is in failsafe when it flies another one.
        last_setpoint_s: vehicle time of the last attitude setpoint, -inf before the first.
        home: see `Home`; moves whenever the vehicle is armed.
        position_trusted: the commander relies on the position.
        gnss_used: the estimator counts on GNSS. gnss_present: the commander does.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.last_setpoint_s = -math.inf
        self.state = vehicle.state()
        self.intended_mode = self.state.mode
        self._motion: Motion | None = None
        self._health: HealthSample | None = None
        self.home = self._here()
        self._position_lost_s = self._fix_s = -math.inf
        self.position_trusted = self.gnss_used = self.gnss_present = False
        self._judge_position()

    def refresh(self) -> None:
        """Forget what was read: call it after the vehicle has moved on or has been commanded."""
        self._motion = None
        self._health = None
        was_armed = self.state.armed
        self.state = self.vehicle.state()
        if self.state.armed and not was_armed:
            self.home = self._here()
        if self.state.mode is FlightMode.HOLD and self.intended_mode is FlightMode.TAKEOFF:
            self.intended_mode = FlightMode.HOLD  # a finished take-off is a wish fulfilled
        if not self.state.armed:
            self.intended_mode = self.state.mode
        self._judge_position()

    @property
    def time_s(self) -> float:
        """Vehicle time of the last step."""
        return self.vehicle.time_s

    @property
    def motion(self) -> Motion:
        """The vehicle's estimate in PX4's frames."""
        if self._motion is None:
            sample = self.vehicle.odometry()
            quaternion = swap_quaternion_enu_ned(sample.quaternion_body_to_world)
            self._motion = Motion(
                sample.time_s,
                triple(swap_enu_ned(sample.position_in_world)),
                triple(swap_enu_ned(sample.velocity_in_world)),
                quadruple(quaternion),
                triple(swap_flu_frd(sample.angular_rate_in_body)),
                euler_from_quaternion(quaternion),
                sample.reset_counter,
            )
        return self._motion

    @property
    def health(self) -> HealthSample:
        """What the vehicle says of its estimator and GNSS."""
        if self._health is None:
            self._health = self.vehicle.health()
        return self._health

    @property
    def setpoints_arrive(self) -> bool:
        """Whether the last attitude setpoint is younger than COM_OF_LOSS_T."""
        return self.time_s - self.last_setpoint_s <= self.parameter("COM_OF_LOSS_T", DEFAULT_OFFBOARD_LOSS_S)

    @property
    def failsafe(self) -> bool:
        """Whether the vehicle flies another mode than it was asked to."""
        return self.state.armed and self.state.mode is not self.intended_mode

    @property
    def can_arm(self) -> bool:
        """PX4's pre-arm check: booted, a healthy estimate, charge, and a mode that can be started on the ground."""
        mode = self.state.mode
        startable = mode not in CANNOT_START and (mode is not FlightMode.OFFBOARD or self.setpoints_arrive)
        charged = not self.vehicle.battery().remaining < self.parameter("BAT_CRIT_THR", DEFAULT_CRITICAL_CHARGE)
        return startable and charged and self.time_s >= READY_S and self.position_trusted

    def parameter(self, name: str, default: float) -> float:
        """Value of a PX4 parameter, the default where the vehicle has none of this name."""
        found = self.vehicle.parameters.get(name)
        return default if found is None else found[1]

    def _judge_position(self) -> None:
        """Work out what follows position and GNSS with a delay."""
        health, now = self.health, self.time_s
        if not health.position_ok:
            self._position_lost_s = now
        self.position_trusted = health.position_ok and now - self._position_lost_s >= PROBATION_S
        if health.gnss_fix >= GNSS_FIX:
            self._fix_s = now
            self.gnss_used |= health.position_ok
            self.gnss_present |= self.position_trusted
        elif not 0.0 <= now - self._fix_s <= GNSS_STOP_S:
            self.gnss_used = self.gnss_present = False

    def _here(self) -> Home:
        motion = self.motion
        return Home(motion.position_m, motion.quaternion, motion.time_s)


def triple(vector: Array) -> tuple[float, float, float]:
    """A (3,) array as floats."""
    x, y, z = vector.tolist()
    return x, y, z


def quadruple(quaternion: Array) -> tuple[float, float, float, float]:
    """A (4,) array as floats."""
    w, x, y, z = quaternion.tolist()
    return w, x, y, z
