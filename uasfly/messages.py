"""What flows between the rooms: telemetry samples, estimates, references, setpoints, requests and status.

World frame ENU, body frame FLU, SI units, radians. Quaternions are Hamilton, w first, body to world.
Every sample carries the time at which it was true, in seconds of the host's monotonic clock
(the link maps vehicle time to it), never the time of its arrival.
"""

from __future__ import annotations

import enum
import math
from dataclasses import field

# ruff: noqa: PLC0414  (what sensors say and the type of arrays: everybody takes them from here)
from uasfly.message_class import Array as Array
from uasfly.message_class import message
from uasfly.sensor_messages import AccelerometerSample as AccelerometerSample
from uasfly.sensor_messages import AttitudeTargetSample as AttitudeTargetSample
from uasfly.sensor_messages import BatterySample as BatterySample
from uasfly.sensor_messages import MarkerSample as MarkerSample
from uasfly.sensor_messages import OdometrySample as OdometrySample
from uasfly.sensor_messages import RotorSample as RotorSample
from uasfly.wind_messages import WindEstimate


class FlightMode(enum.Enum):
    """Flight modes that uasfly tells apart; everything else is OTHER."""

    HOLD = "hold"
    TAKEOFF = "takeoff"
    OFFBOARD = "offboard"
    LAND = "land"
    RETURN = "return"
    POSITION = "position"
    DESCEND = "descend"
    OTHER = "other"


@message
class VehicleSample:
    """Mode, arming and landed state; `time_s` is the last heartbeat's."""

    time_s: float
    mode: FlightMode
    armed: bool
    in_air: bool


@message
class HealthSample:
    """What PX4 says about its estimator and GNSS (ESTIMATOR_STATUS flags, GPS_RAW_INT)."""

    time_s: float
    position_ok: bool
    velocity_ok: bool
    attitude_ok: bool
    gnss_fix: int
    gnss_satellites: int
    horizontal_accuracy_m: float


class LinkEvent(enum.Enum):
    """Events of the link; silence is no event, the age of what has arrived tells it."""

    REBOOTED = "rebooted"  # the vehicle's clock went back


@message
class TextSample:
    """A status text from the vehicle; severity as in MAVLink (0 emergency .. 7 debug)."""

    time_s: float
    severity: int
    text: str


@message
class LinkSample:
    """What the link itself has noticed about the vehicle."""

    time_s: float
    event: LinkEvent


@message
class NamedValue:
    """A number with a name; NaN where it is not known."""

    name: str
    value: float


@message
class FactsSample:
    """What a driver has found out before a flight and telemetry does not tell, see `uasfly.flight.preflight`.

    Attributes:
        time_s: when it was complete.
        parameters: PX4's, NaN for one that was not told.
        home: (3,) m, world; None where there is none, or it was not told.
        rates_hz: at which messages arrive, by name.
        losses: number of messages lost, by cause.
        round_trip_s: smallest recent TIMESYNC round trip; NaN where TIMESYNC is not answered.
        solve_ms: times of warm solver steps on this computer; empty where the controller has no solver.
    """

    time_s: float
    parameters: tuple[NamedValue, ...]
    home: Array | None
    rates_hz: tuple[NamedValue, ...]
    losses: tuple[NamedValue, ...]
    round_trip_s: float
    solve_ms: tuple[float, ...]


@message
class TruthSample:
    """True state where a simulation gives it; only the summary and the log look at it.

    Attributes:
        position_in_world: (3,) m. velocity_in_world: (3,) m/s. quaternion_body_to_world: (4,).
        force_in_world: (3,) m/s^2, mass-normalised force of the wind beyond the still-air drag of its motion.
        wind_in_world: (3,) m/s at the vehicle.
    """

    time_s: float
    position_in_world: Array
    velocity_in_world: Array
    quaternion_body_to_world: Array
    force_in_world: Array
    wind_in_world: Array


class RequestKind(enum.Enum):
    """What the step can ask of the vehicle besides setpoints."""

    ARM = "arm"
    DISARM = "disarm"
    TAKEOFF = "takeoff"
    OFFBOARD = "offboard"
    HOLD = "hold"
    LAND = "land"
    RETURN = "return"


@message
class Request:
    """One command to the vehicle; `height_m` belongs to TAKEOFF (above the ground)."""

    kind: RequestKind
    height_m: float = 0.0


@message
class RequestResult:
    """The vehicle's answer to a request; `text` says why it refused."""

    time_s: float
    request: Request
    accepted: bool
    text: str = ""


Sample = (
    OdometrySample
    | AccelerometerSample
    | RotorSample
    | MarkerSample
    | AttitudeTargetSample
    | BatterySample
    | VehicleSample
    | HealthSample
    | TextSample
    | LinkSample
    | FactsSample
    | TruthSample
    | RequestResult
)


@message
class StateEstimate:
    """What the observer knows at `time_s`.

    Attributes:
        position_in_world: (3,) m. velocity_in_world: (3,) m/s. quaternion_body_to_world: (4,).
        angular_rate_in_body: (3,) rad/s, last measured.
        force_in_world: (3,) m/s^2, mass-normalised wind force.
        gnss_bias_in_world: (3,) m, measured minus true position.
        position_sigma_m, velocity_sigma_m_s, force_sigma_m_s2: (3,) standard deviations.
    """

    time_s: float
    position_in_world: Array
    velocity_in_world: Array
    quaternion_body_to_world: Array
    angular_rate_in_body: Array
    force_in_world: Array
    gnss_bias_in_world: Array
    position_sigma_m: Array
    velocity_sigma_m_s: Array
    force_sigma_m_s2: Array


@message
class ReferenceHorizon:
    """A reference sampled at n times; row 0 is now. Derivatives are consistent with the positions.

    Attributes:
        time_s: (n,). position_in_world: (n, 3) m. velocity_in_world: (n, 3) m/s.
        acceleration_in_world: (n, 3) m/s^2. yaw_rad: (n,) unwrapped. yaw_rate_rad_s: (n,).
    """

    time_s: Array
    position_in_world: Array
    velocity_in_world: Array
    acceleration_in_world: Array
    yaw_rad: Array
    yaw_rate_rad_s: Array


@message
class Setpoint:
    """Attitude and thrust for PX4: ENU/FLU angles (Z-Y-X), yaw rate as feed-forward, thrust 0..1."""

    time_s: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    yaw_rate_rad_s: float
    thrust: float


class Phase(enum.Enum):
    """Where a flight is."""

    CONNECT = "connect"
    PREFLIGHT = "preflight"
    TAKEOFF = "takeoff"
    ENGAGE = "engage"
    LEGS = "legs"
    ENDING = "ending"
    DONE = "done"
    ABORTED = "aborted"


class Action(enum.Enum):
    """What a monitor has done about something, from the mildest to the last."""

    NOTHING = "nothing"
    WARN = "warn"  # tell the pilot
    SLOW_DOWN = "slow_down"  # fly on at a fraction of the speed while it lasts
    HOLD = "hold"  # stop on the path while it lasts, then fly on
    BACK_OFF = "back_off"  # fly back along the way it came while it lasts, then wait there
    END = "end"  # leave the mission: hold, then the mission's own ending
    RETURN = "return"  # leave the mission: PX4's return
    LAND = "land"  # leave the mission: land here
    HAND_OVER = "hand_over"  # stop sending, ask PX4 for hold: the pilot has it

    @property
    def grade(self) -> int:
        """0 for nothing, growing; of several alarms the one with the highest grade acts."""
        return _GRADES[self]


_GRADES = {action: grade for grade, action in enumerate(Action)}


@message
class Alarm:
    """A monitor's finding that lasts.

    Attributes:
        monitor: its name, as in the mission file's section `monitors`.
        action: what is to be done about it now.
        severity: as in MAVLink, 0 emergency .. 7 debug.
        text: for the pilot, with numbers; it stays the same while the alarm's action does.
    """

    monitor: str
    action: Action
    severity: int
    text: str


@message
class Authority:
    """How much of what tilt and thrust can give the wind has taken, 0 none .. 1 all (more: it cannot be held).

    Attributes:
        horizontal, vertical: shares, the present force.
        peak: the larger share that is to be expected soon (recent gusts and trend).
        homeward: share that flying home at the mission's transition speed would take.
    """

    horizontal: float
    vertical: float
    peak: float
    homeward: float


@message
class Status:
    """What a step has to say, for the live view, the log and the summary.

    Attributes:
        time_s: the step's time. phase: where the flight is. leg: index of the current leg, -1 outside.
        leg_started: the first leg has begun and the last has not ended: tracking counts.
        progress: 0..1 of the legs' duration. estimate: None until the observer has started.
        reference_position_in_world: (3,) or None outside the legs.
        reason: why the flight ends or has ended early, "" otherwise.
        fallback: name of what replaced the solver's answer in this step, "" when nothing did.
        announcements: new texts for the pilot, with their severity as in MAVLink.
        mode, armed: the vehicle's, as last heard.
        battery_remaining, battery_voltage_v: NaN where unknown.
        telemetry_age_s: of the last odometry; infinite before the first.
        authority: None until there is an estimate.
        alarms: what the monitors find now. action: the highest of theirs, which is being done.
        pace: rate at which the mission's own time runs: 1 as planned, 0 held, negative on the way back.
        pilot_flies: the mission waits, because somebody else has the vehicle until it is switched to offboard.
        marker_age_s: of the last sighting of the marker that the mission hangs on; NaN without one.
        waits_for: what the vehicle waits for, in offboard, before the legs can begin; "" for nothing.
        wind: None on the ground, and until it is known.
        thrust_trim: share by which the thrust is more (negative: less) than airframe file and voltage say.
    """

    time_s: float
    phase: Phase
    leg: int
    leg_started: bool
    progress: float
    estimate: StateEstimate | None
    reference_position_in_world: Array | None
    fallback: str = ""
    reason: str = ""
    announcements: tuple[tuple[int, str], ...] = field(default=())
    mode: FlightMode = FlightMode.OTHER
    armed: bool = False
    battery_remaining: float = math.nan
    battery_voltage_v: float = math.nan
    telemetry_age_s: float = math.inf
    authority: Authority | None = None
    alarms: tuple[Alarm, ...] = ()
    action: Action = Action.NOTHING
    pace: float = 1.0
    pilot_flies: bool = False
    marker_age_s: float = math.nan
    waits_for: str = ""
    wind: WindEstimate | None = None
    thrust_trim: float = 0.0
