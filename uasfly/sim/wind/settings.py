"""What a scenario file says about the wind: mean wind, gusts and blower jets, checked on load.

Directions are the ones the air moves toward. Angles are degrees in the file, because people write it.
`model_dump()` of these models is what the flight log keeps.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from uasfly.airframe import FileModel, NonNegative, Positive

Finite = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
FASTEST_AIR_M_S = 100.0  # a hurricane; the drag of much more than that no step of the simulation can follow
AirSpeed = Annotated[float, Field(ge=0.0, le=FASTEST_AIR_M_S, allow_inf_nan=False)]
AirVelocityPart = Annotated[float, Field(ge=-FASTEST_AIR_M_S, le=FASTEST_AIR_M_S, allow_inf_nan=False)]
AirVelocity = tuple[AirVelocityPart, AirVelocityPart, AirVelocityPart]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]

TWENTY_FEET_M = 6.096  # height at which MIL-F-8785C measures the wind that scales its low-altitude gusts
TEN_METRES_M = 10.0
VON_KARMAN = 0.4
LAYER_SHARE = 0.02
EARTH_RATE_RAD_S = 7.2921e-5


class ConstantWind(FileModel):
    """The same mean wind at every height."""

    kind: Literal["constant"] = "constant"
    velocity_in_world_m_s: Annotated[AirVelocity, Field(description="x east, y north, z up")]

    @property
    def w20_m_s(self) -> float:
        """Horizontal speed at 6.096 m (20 ft) [m/s]."""
        return math.hypot(self.velocity_in_world_m_s[0], self.velocity_in_world_m_s[1])


class BoundaryLayer(FileModel):
    """Logarithmic profile over flat ground, v(z) = (v*/k) ln(z/z0) (Waslander & Wang 2009)."""

    kind: Literal["boundary_layer"] = "boundary_layer"
    speed_at_10_m_m_s: AirSpeed
    toward_deg: Annotated[Finite, Field(description="where the wind blows to: 0 = +x (east), 90 = +y (north)")]
    roughness_m: Annotated[float, Field(gt=0.0, le=2.0, description="z0; 0.05 m is short grass")] = 0.05

    @property
    def w20_m_s(self) -> float:
        """Speed at 6.096 m (20 ft) [m/s]."""
        return (
            self.speed_at_10_m_m_s
            * math.log(TWENTY_FEET_M / self.roughness_m)
            / math.log(TEN_METRES_M / self.roughness_m)
        )

    def top_m(self, latitude_deg: float) -> float:
        """Height b v*/(2 omega_e sin latitude), b = 0.02, up to which the paper takes the profile to hold [m]."""
        friction_velocity = VON_KARMAN * self.speed_at_10_m_m_s / math.log(TEN_METRES_M / self.roughness_m)
        return LAYER_SHARE * friction_velocity / (2.0 * EARTH_RATE_RAD_S * math.sin(math.radians(abs(latitude_deg))))


class RadialTable(FileModel):
    """Speed across a jet as a table, the same at every distance from the nozzle; nothing beyond its last offset."""

    kind: Literal["table"] = "table"
    points: Annotated[
        tuple[tuple[NonNegative, Fraction], ...],
        Field(min_length=2, description="pairs of offset from the axis [m] and fraction of the speed on the axis"),
    ]

    @field_validator("points")
    @classmethod
    def _starts_on_the_axis(cls, points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        if points[0] != (0.0, 1.0):
            raise ValueError(f"the first point must be [0, 1] (the axis itself), found {list(points[0])}")
        return _ascending(points, "offsets")


class RadialGaussian(FileModel):
    """Gaussian across the jet; half of the axis's speed at half_width_at_nozzle_m + spread * distance.

    A free round jet spreads by 0.094 (Hussein, Capp & George 1994).
    """

    kind: Literal["gaussian"] = "gaussian"
    half_width_at_nozzle_m: Positive
    spread: Annotated[float, Field(ge=0.0, le=1.0, description="[m/m] growth of the half-width with distance")] = 0.094


class JetTurbulence(FileModel):
    """Turbulence of a jet: first-order coloured noise with time constant length_scale_m / speed on the axis.

    The eddies of a free jet are a few centimetres long and average out over an airframe; what moves a vehicle is the
    slow meandering of the whole stream. 1.5 m makes its time constant 0.10 s at 15 m/s and 0.27 s at 5.5 m/s.
    """

    intensity: Annotated[float, Field(ge=0.0, le=0.5, description="sigma along the axis / local mean speed")] = 0.15
    cross_fraction: Annotated[float, Field(ge=0.0, le=1.0, description="sigma across / sigma along")] = 0.5
    length_scale_m: Positive = 1.5


class JetSchedule(FileModel):
    """When a jet blows, on the stop watch that starts when the vehicle first enters offboard.

    It rises from start_s to start_s + edge_s and falls from end_s to end_s + edge_s (raised cosines), so it blows
    as much air as a rectangle of end_s - start_s would.
    """

    start_s: NonNegative = 0.0
    end_s: Annotated[float | None, Field(ge=0.0, le=1e9, description="never, when absent", allow_inf_nan=False)] = None
    edge_s: NonNegative = 0.3

    @model_validator(mode="after")
    def _ends_after_it_has_risen(self) -> JetSchedule:
        if self.end_s is not None and self.end_s < self.start_s + self.edge_s:
            raise ValueError(
                f"end_s must be at least start_s + edge_s = {self.start_s + self.edge_s}, found {self.end_s}; "
                "blow longer or make edge_s smaller"
            )
        return self


class JetSettings(FileModel):
    """A blower: an axis through `aim_m`, a nozzle `distance_m` before it, speeds along and across that axis.

    Between the points of `axis_speed` the speed is interpolated linearly; nearer than the first point it keeps the
    first speed, beyond the last it decays with 1 / distance; behind the nozzle there is nothing.
    """

    name: Annotated[str, Field(min_length=1)]
    aim_m: Annotated[Vector, Field(description="point in the world that the axis passes through")]
    distance_m: Annotated[Positive, Field(description="from the nozzle to aim_m")]
    azimuth_deg: Annotated[Finite, Field(description="where it blows to: 0 = +x (east), 90 = +y (north)")]
    elevation_deg: Annotated[float, Field(ge=-90.0, le=90.0, description="positive blows upward")] = 0.0
    axis_speed: Annotated[
        tuple[tuple[NonNegative, AirSpeed], ...],
        Field(min_length=1, description="pairs of distance from the nozzle [m] and speed on the axis [m/s]"),
    ]
    radial: Annotated[RadialTable | RadialGaussian, Field(discriminator="kind")]
    turbulence: JetTurbulence = JetTurbulence()
    schedule: JetSchedule = JetSchedule()
    follow: Annotated[
        Literal["none", "height", "vehicle"],
        Field(description="what of the vehicle's position aim_m (and the nozzle with it) follows, as a hand would"),
    ] = "none"
    follow_lag_s: Annotated[NonNegative, Field(description="time constant of the following hand")] = 0.3

    @field_validator("axis_speed")
    @classmethod
    def _distances_ascend(cls, points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        if points[-1][0] <= 0.0:
            raise ValueError(f"the last distance must be greater than 0, found {points[-1][0]}")
        return _ascending(points, "distances")

    @property
    def direction_in_world(self) -> tuple[float, float, float]:
        """Unit vector that the jet blows along."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        level = math.cos(elevation)
        return level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)

    @property
    def nozzle_in_world(self) -> tuple[float, float, float]:
        """Nozzle [m] while the hand has not followed anything yet."""
        x, y, z = self.aim_m
        dx, dy, dz = self.direction_in_world
        return x - self.distance_m * dx, y - self.distance_m * dy, z - self.distance_m * dz


class WindSettings(FileModel):
    """All the air that moves in a scenario."""

    mean: Annotated[ConstantWind | BoundaryLayer, Field(discriminator="kind")] = ConstantWind(
        velocity_in_world_m_s=(0.0, 0.0, 0.0)
    )
    gusts: Annotated[
        Literal["none", "dryden", "sum_of_sines"],
        Field(
            description="dryden: MIL-F-8785C, low altitude; sum_of_sines: a band of it as Waslander & Wang 2009 fly it"
        ),
    ] = "none"
    jets: tuple[JetSettings, ...] = ()

    @model_validator(mode="after")
    def _gusts_need_a_mean(self) -> WindSettings:
        if self.gusts != "none" and self.mean.w20_m_s == 0.0:
            raise ValueError(
                f"gusts: {self.gusts} scales with the mean wind at 6.1 m, which is 0; "
                "give wind.mean a speed or remove gusts"
            )
        return self


def _ascending(points: tuple[tuple[float, float], ...], what: str) -> tuple[tuple[float, float], ...]:
    for (before, _), (after, _) in pairwise(points):
        if after <= before:
            raise ValueError(f"{what} must ascend, found {after} after {before}")
    return points
