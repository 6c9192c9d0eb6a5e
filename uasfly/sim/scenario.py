"""Scenario files: the wind, the sensors, the link and the faults that a simulated flight meets.

PX4-like noise comes from PX4's own simulator (SIH quad, main of August 2026): its estimate against ground truth over
90 s of excitation; the accelerometer's noise too. Its vibration comes from real flights: in a single integral of 5 ms
0.4 to 0.9 m/s^2 on two light quadrotors, 1.1 to 3.5 on two octorotors and a racing quadrotor, at 40 to 110 Hz, so that
the mean of four consecutive ones holds about a quarter of it. The bias is what PX4's estimator there is unsure of.
Beside small white noise every quantity wanders slowly (1/e correlation 2-6 s): velocity by
0.011-0.032 m/s, roll and pitch by 0.0014-0.0024 rad, yaw by 0.0051 rad; the angular rate is white with 0.006 rad/s;
delay is compensated to within about 8 ms, on one axis 12 ms.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from uasfly.airframe import FileModel, NonNegative, Positive
from uasfly.sim.camera.settings import CameraSettings
from uasfly.sim.faults import Fault
from uasfly.sim.wind.settings import Vector, WindSettings

Delay = Annotated[float, Field(ge=0.0, le=1.0)]


class Gnss(FileModel):
    """Virtual GNSS of Kalaitzakis & Vitzilaios 2023, eq. 11: p_gnss = p + b_k + w, b_k = b_{k-1} + v.

    The walk v is a density, so that its growth does not depend on the rate; it begins with the simulation, or
    `walk_from_s` after the vehicle first went into offboard (as jets count), where GNSS is sound on the way there.
    (The paper's v, variance 1e-3 m^2 a sample, is 0.1 m/sqrt(s) at 10 Hz.)
    """

    white_sigma_m: Annotated[NonNegative, Field(description="sigma of w on each axis, in each new position")]
    random_walk_m_sqrt_s: Annotated[NonNegative, Field(description="[m/sqrt(s)] density of v on each axis")]
    initial_bias_m: Annotated[Vector, Field(description="b at the beginning, x, y, z")] = (0.0, 0.0, 0.0)
    walk_from_s: Annotated[
        NonNegative | None, Field(description="in offboard: until then b stays as it is; null: it walks from the start")
    ] = None

    def expected_rms_m(self, duration_s: float) -> float:
        """Root of the expected mean square of the three-dimensional error [m] over the first `duration_s` seconds.

        They count as `walk_from_s` does. An axis has b0^2 + q^2 (t - t0) + sigma_w^2 at time t after t0; q^2 (t - t0)
        averages to q^2 (T - t0)^2 / 2T.
        """
        walking_s = max(0.0, duration_s - (self.walk_from_s or 0.0))
        walk = self.random_walk_m_sqrt_s**2 * walking_s**2 / (2.0 * duration_s)
        return math.sqrt(3.0 * (walk + self.white_sigma_m**2) + sum(b * b for b in self.initial_bias_m))


class Delays(FileModel):
    """Age of the truth in a sample, beyond the sample's own time stamp: what PX4's delay compensation leaves."""

    position_s: Delay = 0.0
    velocity_s: Delay = 0.0
    attitude_s: Delay = 0.0


class Sensors(FileModel):
    """How PX4's estimate differs from the truth.

    Position: truth + bias (gnss only) + white noise; both are drawn anew `position_rate_hz` times a second and held
    between, as PX4 carries its estimate on by inertia. All other white noise is drawn anew in every sample.
    A wander is a first-order Gauss-Markov process of the given sigma on each axis, with `wander_time_s`.
    """

    position: Literal["mocap", "gnss"]
    position_rate_hz: Annotated[float, Field(ge=1.0, le=250.0)] = 50.0
    position_noise_m: Annotated[
        NonNegative | None, Field(description="white noise on each axis with mocap; gnss has its own section")
    ] = None
    gnss: Gnss | None = None
    velocity_noise_m_s: NonNegative = 0.02
    velocity_wander_m_s: NonNegative = 0.01
    attitude_noise_rad: Annotated[NonNegative, Field(description="white, on roll, pitch and yaw")] = 0.002
    attitude_wander_rad: Annotated[NonNegative, Field(description="on roll, pitch and yaw")] = 0.002
    angular_rate_noise_rad_s: NonNegative = 0.006
    wander_time_s: Positive = 4.0
    accelerometer_noise_m_s2: Annotated[NonNegative, Field(description="white, in each reading, on each axis")] = 0.07
    accelerometer_bias_m_s2: Annotated[
        NonNegative, Field(description="sigma of the bias that PX4's estimator leaves, for the whole flight")
    ] = 0.03
    vibration_m_s2: Annotated[
        NonNegative, Field(description="shaking by the rotors in hover, sigma in a single reading, on each axis")
    ] = 0.5
    rotor_speeds: Annotated[bool, Field(description="whether the speed controllers tell the rotors' speeds")] = False
    rotor_noise_rad_s: Annotated[NonNegative, Field(description="white, on the speed of each rotor")] = 1.0
    delays: Delays = Delays()

    @model_validator(mode="after")
    def _source_has_its_figures(self) -> Sensors:
        if self.position == "gnss" and (self.gnss is None or self.position_noise_m is not None):
            raise ValueError("position: gnss needs the section gnss, and no position_noise_m (use gnss.white_sigma_m)")
        if self.position == "mocap" and (self.gnss is not None or self.position_noise_m is None):
            raise ValueError("position: mocap needs position_noise_m, and no section gnss")
        return self

    @property
    def position_white_sigma_m(self) -> float:
        """White noise of a new position on each axis [m], whichever source gives it."""
        if self.gnss is not None:
            return self.gnss.white_sigma_m
        return self.position_noise_m or 0.0


class Link(FileModel):
    """How long messages travel: a latency each way plus a random extra, uniform in 0..jitter_s, for each message."""

    telemetry_latency_s: Delay = 0.0
    command_latency_s: Delay = 0.0
    jitter_s: Delay = 0.0


class Scenario(FileModel):
    """One scenario file. The world's origin is the take-off point on the ground: x east, y north, z up."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_\-]+$")]
    description: str = ""
    wind: WindSettings = WindSettings()
    sensors: Sensors = Sensors(position="mocap", position_noise_m=0.01)
    link: Link = Link()
    camera: Annotated[
        CameraSettings | None, Field(description="what the simulated camera meets, where there is one")
    ] = None
    faults: Annotated[tuple[Fault, ...], Field(max_length=200, description="what goes wrong, and when")] = ()
