"""Airframe files: who the vehicle is, its identified model, its limits, and the settings of controller and observer.

Angles are degrees in the file, because people write it, and radians everywhere behind this module.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

GRAVITY_M_S2 = 9.80665

# No quantity that people write down lies beyond these, and no product of a few of them overflows.
SMALLEST, LARGEST = 1e-9, 1e9
Positive = Annotated[float, Field(gt=SMALLEST, le=LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST, allow_inf_nan=False)]
Triple = tuple[NonNegative, NonNegative, NonNegative]


class FileModel(BaseModel):
    """Base of everything read from a file: unknown fields are errors, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class FirstOrder(FileModel):
    """Closed attitude loop of one axis: angle' = (gain * command - angle) / tau (Kalaitzakis 2023, eq. 2)."""

    tau_s: Positive
    gain: Annotated[float, Field(gt=0.3, lt=2.0)]


class ModelParameters(FileModel):
    """Identified model (Kalaitzakis 2023, eq. 1 and 2)."""

    k_thrust_m_s2: Annotated[
        float, Field(gt=GRAVITY_M_S2, le=1000.0, description="thrust acceleration at full thrust command")
    ]
    drag_1_s: Annotated[Triple, Field(description="linear drag x, y, z, positive: acceleration = -drag * velocity")]
    roll: FirstOrder
    pitch: FirstOrder
    command_delay_s: Annotated[float, Field(ge=0.0, le=0.3, description="dead time from setpoint to response")]
    thrust_delay_s: Annotated[
        float | None,
        Field(
            ge=0.0, le=0.3, description="the same of the thrust, which is not behind an attitude loop, where it differs"
        ),
    ] = None
    hover_rotor_rad_s: Annotated[
        Positive | None,
        Field(description="speed of the rotors that carries the weight in still air at sea level; null: not used"),
    ] = None

    @property
    def thrust_acts_after_s(self) -> float:
        """Dead time of the thrust [s]."""
        return self.command_delay_s if self.thrust_delay_s is None else self.thrust_delay_s

    @property
    def hover_thrust(self) -> float:
        """Thrust command 0..1 that balances gravity."""
        return GRAVITY_M_S2 / self.k_thrust_m_s2


class Limits(FileModel):
    """What the vehicle may be asked to do; tilt and thrust bound the setpoints, the rest bounds the references."""

    wind_m_s: Annotated[float, Field(gt=0.0, le=40.0, description="steady wind that the limits are sized for")]
    tilt_deg: Annotated[float, Field(gt=2.0, le=60.0)]
    thrust_min: Annotated[float, Field(ge=0.0, lt=1.0)]
    thrust_max: Annotated[float, Field(gt=0.0, le=1.0)]
    speed_m_s: Positive
    climb_m_s: Positive
    descent_m_s: Positive
    acceleration_m_s2: Positive
    yaw_rate_deg_s: Positive

    @property
    def tilt_rad(self) -> float:
        """Largest roll and pitch command [rad]."""
        return math.radians(self.tilt_deg)

    @property
    def yaw_rate_rad_s(self) -> float:
        """Largest yaw rate [rad/s]."""
        return math.radians(self.yaw_rate_deg_s)


class Weights(FileModel):
    """Stage weights of the optimal control problem (Kalaitzakis 2023, eq. 10)."""

    position: Triple
    velocity: Triple
    tilt: tuple[NonNegative, NonNegative]
    roll: Positive
    pitch: Positive
    thrust: Positive
    terminal: Annotated[float, Field(ge=0.0, le=1e6, description="terminal weight as a multiple of the stage weights")]
    move: Annotated[
        float,
        Field(ge=0.0, le=20.0, description="weight on the first input's step from the last command, as a multiple"),
    ] = 0.0


class ControllerSettings(FileModel):
    """Rate, horizon and weights of the NMPC; the grid starts with `first_interval_s` and widens from there."""

    rate_hz: Annotated[float, Field(ge=5.0, le=250.0)]
    horizon_s: Annotated[float, Field(ge=0.5, le=10.0)]
    nodes: Annotated[int, Field(ge=5, le=160)]
    first_interval_s: Annotated[float, Field(ge=0.004, le=0.5)]
    weights: Weights

    @model_validator(mode="after")
    def _grid_reaches_the_horizon(self) -> ControllerSettings:
        if self.first_interval_s * self.nodes > self.horizon_s * (1.0 + 1e-9):
            raise ValueError(
                f"first_interval_s * nodes must not exceed horizon_s, found "
                f"{self.first_interval_s} * {self.nodes} > {self.horizon_s}; use fewer nodes or a smaller interval"
            )
        return self


class Pid(FileModel):
    """Gains of a PID; `integral_limit` bounds the integral's contribution, in units of the output."""

    kp: NonNegative
    ki: NonNegative
    kd: NonNegative
    integral_limit: NonNegative


class Backup(FileModel):
    """The backup PIDs: position error to acceleration [m/s^2], horizontal and vertical (Kalaitzakis 2023)."""

    horizontal: Pid
    vertical: Pid


class ObserverNoise(FileModel):
    """Noise of the observer: process noise as densities, so that nothing depends on rates, and the sensors' sigmas."""

    acceleration_density: Annotated[Positive, Field(description="[m/s^2/sqrt(Hz)] unmodelled acceleration")]
    attitude_density: Annotated[Positive, Field(description="[rad/s/sqrt(Hz)] gyro noise")]
    force_density: Annotated[
        Positive, Field(description="[m/s^2/sqrt(s)] random walk of the wind force; up to 3 times that in gusts")
    ]
    gnss_bias_density: Annotated[Positive, Field(description="[m/sqrt(s)] random walk of the GNSS bias")]
    velocity_wander_m_s: Annotated[
        NonNegative, Field(description="sigma of the slow error of PX4's velocity, on each axis")
    ] = 0.03
    attitude_wander_rad: Annotated[
        NonNegative, Field(description="sigma of the slow error of PX4's attitude, on each axis")
    ] = 0.003
    wander_time_s: Annotated[Positive, Field(description="time in which these slow errors forget themselves")] = 4.0
    position_sigma_m: Positive
    attitude_sigma_rad: Positive
    velocity_sigma_m_s: Positive
    position_correlation_s: Annotated[
        NonNegative, Field(description="correlation time of the position's error; 0 = white at whatever rate it comes")
    ] = 0.0
    attitude_correlation_s: Annotated[NonNegative, Field(description="position_correlation_s of the attitude")] = 0.0
    velocity_correlation_s: Annotated[NonNegative, Field(description="position_correlation_s of the velocity")] = 0.0
    accelerometer_sigma_m_s2: Annotated[
        Positive | None,
        Field(description="noise of the mean of a control cycle's readings, in the rotors' plane; null: not used"),
    ] = None
    matching_window_s: Annotated[Positive, Field(description="window of the covariance matching (eq. 8, 9)")]


class Battery(FileModel):
    """Thrust against battery voltage: k_thrust * (voltage / reference_voltage_v) ** thrust_exponent."""

    reference_voltage_v: Positive
    thrust_exponent: Annotated[float, Field(ge=0.0, le=3.0)]


class WindSettings(FileModel):
    """What the wind's speed is told by: the drag against the airspeed, as identified (see `uasfly.identify.drag`)."""

    drag_1_s: Annotated[
        float, Field(ge=1e-3, le=100.0, description="linear part: acceleration over airspeed, horizontal")
    ]
    drag_1_m: Annotated[
        float, Field(ge=0.0, le=100.0, description="quadratic part: acceleration over squared airspeed")
    ]
    drag_sigma_share: Annotated[
        float, Field(gt=0.0, le=1.0, description="standard deviation of the drag at a given airspeed, relative")
    ]
    tilt_sigma_rad: Annotated[
        float, Field(gt=0.0, le=0.1, description="standard deviation of PX4's roll and pitch over seconds")
    ] = 0.003


class Airframe(FileModel):
    """One vehicle as uasfly knows it."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_\-]+$")]
    description: str = ""
    mass_kg: Positive
    rotors: Annotated[int, Field(ge=3, le=12)]
    plant: Annotated[str, Field(description="plant file of the built-in simulation that stands for this airframe")]
    model: ModelParameters
    limits: Limits
    controller: ControllerSettings
    yaw_pid: Pid
    backup: Backup
    observer: ObserverNoise
    battery: Battery
    wind: Annotated[
        WindSettings | None, Field(description="without it the model's linear drag, which is far less certain")
    ] = None

    @model_validator(mode="after")
    def _thrust_range_holds_hover(self) -> Airframe:
        hover = self.model.hover_thrust
        if not self.limits.thrust_min < hover < self.limits.thrust_max:
            raise ValueError(
                f"hover thrust {hover:.3f} (gravity / k_thrust_m_s2) must lie between limits.thrust_min "
                f"{self.limits.thrust_min} and limits.thrust_max {self.limits.thrust_max}"
            )
        return self
