"""Plant files: the physical figures of a simulated vehicle and the PX4 parameters it is set up with.

Masses, lengths and coefficients only; what an airframe file says (time constants, k_thrust, linear drag) has to come
out of them when the plant is flown.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from uasfly.airframe import FileModel, NonNegative, Positive, Triple
from uasfly.errors import shortened
from uasfly.file_problems import nearest
from uasfly.sim.parameters import ParameterTable

AIR_DENSITY_KG_M3 = 1.225  # ICAO standard atmosphere, sea level

PositiveTriple = tuple[Positive, Positive, Positive]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
ParameterValue = Annotated[float, Field(ge=-(2.0**31), le=2.0**31 - 1.0, allow_inf_nan=False)]

# Azimuth of each arm from the nose, counter-clockwise [deg], and spin of its rotor from above (+1 counter-clockwise,
# -1 clockwise), in PX4's motor order (airframe reference: Quadrotor x, Hexarotor x).
_LAYOUTS: dict[str, tuple[tuple[float, int], ...]] = {
    "quad_x": ((-45.0, 1), (135.0, 1), (45.0, -1), (-135.0, -1)),
    "hex_x": ((-90.0, -1), (90.0, 1), (30.0, -1), (-150.0, 1), (-30.0, 1), (150.0, -1)),
}


class Rotors(FileModel):
    """The rotors, all alike. Thrust in still air is thrust_coefficient * speed ** 2 (* speed with the linear law)."""

    layout: Literal["quad_x", "hex_x"]
    arm_length_m: Annotated[
        float, Field(gt=0.01, le=10.0, description="from the centre of mass to a rotor axis, seen from above")
    ]
    height_m: Annotated[float, Field(ge=-0.5, le=0.5, description="rotor plane above the centre of mass")] = 0.0
    radius_m: Annotated[float, Field(gt=0.001, le=10.0)]
    thrust_law: Annotated[
        Literal["quadratic", "linear"], Field(description="linear: PX4's SIH, which has no blades to speak of")
    ] = "quadratic"
    thrust_coefficient: Annotated[Positive, Field(description="[N s^2] with the quadratic law, [N s] with the linear")]
    torque_per_thrust_m: Annotated[
        float, Field(gt=1e-5, le=1.0, description="drag torque over thrust in hover; it is what turns the vehicle")
    ]
    full_speed_rad_s: Annotated[Positive, Field(description="at full command and battery.reference_voltage_v")]
    motor_resistance_ohm: Annotated[NonNegative, Field(description="winding and speed controller, each motor")] = 0.0
    lag_s: Annotated[float, Field(ge=0.01, le=0.5, description="first-order lag of the speed")]
    inertia_kg_m2: Annotated[NonNegative, Field(description="of one rotor and motor bell about its axis")] = 0.0
    inflow_slope: Annotated[
        NonNegative,
        Field(description="thrust lost per unit of inflow over hover inflow, solidity * lift slope / (8 inflow ratio)"),
    ] = 0.0
    flapping_kg: Annotated[
        NonNegative, Field(description="in-plane force of one rotor over (speed * in-plane airspeed) [N s^2/(m rad)]")
    ] = 0.0

    @model_validator(mode="after")
    def _linear_law_has_no_blades(self) -> Rotors:
        if self.thrust_law == "linear" and (self.inflow_slope or self.flapping_kg):
            raise ValueError(
                f"thrust_law linear goes with inflow_slope 0 and flapping_kg 0, found {self.inflow_slope} and "
                f"{self.flapping_kg}; use the quadratic law for rotors with blades"
            )
        return self

    @property
    def count(self) -> int:
        """Number of rotors."""
        return len(_LAYOUTS[self.layout])

    @property
    def positions_m(self) -> tuple[tuple[float, float], ...]:
        """Rotor axes (x forward, y left) in the body [m], in PX4's motor order."""
        arm = self.arm_length_m
        return tuple(
            (arm * math.cos(math.radians(azimuth)), arm * math.sin(math.radians(azimuth)))
            for azimuth, _ in _LAYOUTS[self.layout]
        )

    @property
    def spins(self) -> tuple[int, ...]:
        """Spin of each rotor seen from above: +1 counter-clockwise (along body z), -1 clockwise."""
        return tuple(spin for _, spin in _LAYOUTS[self.layout])

    @property
    def speed_exponent(self) -> int:
        """Power of the rotor speed that thrust and drag torque grow with."""
        return 2 if self.thrust_law == "quadratic" else 1

    @property
    def disc_area_m2(self) -> float:
        """Area that one rotor sweeps [m^2]."""
        return math.pi * self.radius_m**2

    def static_thrust_n(self, speed_rad_s: float) -> float:
        """Thrust of one rotor in still air [N]."""
        return self.thrust_coefficient * speed_rad_s**self.speed_exponent


class BodyDrag(FileModel):
    """Drag of everything but the rotors, in body axes, in the wind relative to the vehicle."""

    area_m2: Annotated[Triple, Field(description="drag area C_D * A along x, y, z")] = (0.0, 0.0, 0.0)
    linear_n_s_m: Annotated[Triple, Field(description="force over airspeed along x, y, z")] = (0.0, 0.0, 0.0)
    angular_n_m_s: Annotated[Triple, Field(description="torque over angular rate about x, y, z")] = (0.0, 0.0, 0.0)


class LandingGear(FileModel):
    """Four feet on the corners of a square."""

    half_width_m: Positive
    height_m: Annotated[Positive, Field(description="centre of mass above the feet")]
    friction: Annotated[float, Field(gt=0.0, le=2.0, description="Coulomb coefficient")] = 0.6


class BatteryPack(FileModel):
    """A battery: open-circuit voltage by charge behind an internal resistance."""

    capacity_ah: Positive
    resistance_ohm: NonNegative
    reference_voltage_v: Annotated[
        Positive, Field(description="terminal voltage that rotors.full_speed_rad_s belongs to")
    ]
    open_circuit: Annotated[
        tuple[tuple[Fraction, Positive], ...],
        Field(min_length=2, description="pairs of charge 0..1 and voltage [V], ascending, from 0 to 1"),
    ]
    avionics_current_a: NonNegative = 0.0
    initial_charge: Fraction = 1.0
    lowers_thrust: Annotated[bool, Field(description="false: full command gives the full speed at any voltage")] = True

    @field_validator("open_circuit")
    @classmethod
    def _curve_ascends_over_all_charges(cls, curve: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        charges, voltages = [point[0] for point in curve], [point[1] for point in curve]
        if charges[0] != 0.0 or charges[-1] != 1.0 or charges != sorted(set(charges)) or voltages != sorted(voltages):
            shown = shortened(str(list(curve)), 200)
            raise ValueError(f"charge must ascend from 0 to 1 and voltage must not fall, found {shown}")
        return curve


def _like(name: str, known: Iterable[str]) -> str:
    match = nearest(name, known)
    return f"did you mean {match}?" if match else "leave it out"


class Plant(FileModel):
    """One simulated vehicle. The body origin is the centre of mass; x forward, y left, z up."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_\-]+$")]
    description: str = ""
    mass_kg: Positive
    inertia_kg_m2: Annotated[PositiveTriple, Field(description="principal moments about x, y, z")]
    rotors: Rotors
    drag: BodyDrag = BodyDrag()
    gear: LandingGear
    battery: BatteryPack
    parameters: Annotated[
        dict[str, ParameterValue],
        Field(default_factory=dict, description="PX4 parameters of this vehicle other than the simulation's defaults"),
    ]

    @field_validator("parameters")
    @classmethod
    def _parameters_exist(cls, parameters: dict[str, float]) -> dict[str, float]:
        known = ParameterTable()
        unknown = sorted(set(parameters) - set(known))
        if unknown:
            others = f", and {len(unknown) - 1} more" if len(unknown) > 1 else ""
            name = unknown[0]
            raise ValueError(f"the simulation has no PX4 parameter {shortened(name)}{others}; {_like(name, known)}")
        return parameters

    @model_validator(mode="after")
    def _can_hover(self) -> Plant:
        full = self.rotors.count * self.rotors.static_thrust_n(self.rotors.full_speed_rad_s)
        if full < 1.1 * self.mass_kg * 9.80665:
            raise ValueError(
                f"full thrust must exceed the weight by a tenth, found {full:.2f} N for {self.mass_kg} kg; "
                "check rotors.thrust_coefficient and rotors.full_speed_rad_s"
            )
        if self.motor_speed_constant is None:
            raise ValueError(
                f"rotors.motor_resistance_ohm {self.rotors.motor_resistance_ohm} is too large: no motor reaches "
                f"{self.rotors.full_speed_rad_s} rad/s at {self.battery.reference_voltage_v} V behind it"
            )
        return self

    @property
    def hover_speed_rad_s(self) -> float:
        """Speed of the rotors that carries the weight in still air [rad/s]."""
        thrust_n = self.mass_kg * 9.80665 / self.rotors.count
        return float((thrust_n / self.rotors.thrust_coefficient) ** (1.0 / self.rotors.speed_exponent))

    @property
    def motor_speed_constant(self) -> float | None:
        """K [rad/s/V] such that full command at the reference voltage gives the full speed; None: there is no such K.

        A direct-current motor with resistance R turning a rotor of drag torque Q obeys V = w / K + R K Q; of the two
        solutions the one with the smaller current is meant.
        """
        rotors, voltage, speed = self.rotors, self.battery.reference_voltage_v, self.rotors.full_speed_rad_s
        resistive = rotors.motor_resistance_ohm * rotors.torque_per_thrust_m * rotors.static_thrust_n(speed)
        if resistive * speed < 1e-12 * voltage * voltage:  # as good as none, and the difference below would be zero
            return speed / voltage
        discriminant = voltage * voltage - 4.0 * resistive * speed
        return None if discriminant < 0.0 else (voltage - math.sqrt(discriminant)) / (2.0 * resistive)
