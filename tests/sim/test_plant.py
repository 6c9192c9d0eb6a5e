from __future__ import annotations

import math

import pytest

from tests.sim.plants import PLANTS, k_thrust, plant
from uasfly.errors import FileError
from uasfly.files import shipped_names
from uasfly.sim.battery import Battery


def test_all_plants_are_shipped() -> None:
    """The four plants that airframes name come with the package."""
    assert tuple(shipped_names("plant")) == PLANTS


@pytest.mark.parametrize(
    ("name", "mass", "thrust"),
    [("f550", 1.8, 28.54), ("aurelia_x6", 9.3, 32.56), ("iris", 1.5, 13.85), ("px4_sih", 1.0, 20.0)],
)
def test_full_thrust_over_mass_is_the_airframes_k_thrust(name: str, mass: float, thrust: float) -> None:
    """Full thrust at reference voltage over the mass is k_thrust of the reference implementation."""
    figures = plant(name)
    assert figures.mass_kg == mass
    assert k_thrust(figures) == pytest.approx(thrust, rel=2e-3)


@pytest.mark.parametrize("name", PLANTS)
def test_rotors_balance(name: str) -> None:
    """Equal thrusts make no torque: arms and spins sum to zero."""
    rotors = plant(name).rotors
    assert sum(x for x, _ in rotors.positions_m) == pytest.approx(0.0, abs=1e-12)
    assert sum(y for _, y in rotors.positions_m) == pytest.approx(0.0, abs=1e-12)
    assert sum(rotors.spins) == 0


def test_neighbours_on_the_hexacopter_spin_against_each_other() -> None:
    """Around the hexacopter the spins alternate."""
    rotors = plant("f550").rotors
    around = sorted(
        zip(rotors.positions_m, rotors.spins, strict=True), key=lambda pair: math.atan2(pair[0][1], pair[0][0])
    )
    spins = [spin for _, spin in around]
    assert all(a == -b for a, b in zip(spins, spins[1:] + spins[:1], strict=True))


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("mass_kg", 6.0, "full thrust must exceed the weight"),
        ("rotors.motor_resistance_ohm", 5.0, "motor_resistance_ohm 5.0 is too large"),
        ("rotors.thrust_law", "linear", "thrust_law linear goes with"),
        ("parameters.MC_ROL_P", 1.0, "MC_ROL_P"),
        ("battery.open_circuit", [[0.0, 12.0], [0.5, 13.0]], "charge must ascend from 0 to 1"),
        ("inertia_kg_m2", [0.02, 0.0, 0.02], "inertia_kg_m2"),
        ("rotors.full_speed_rad_s", 1e200, "full_speed_rad_s: expected a number.*not above"),
        ("rotors.torque_per_thrust_m", 0.0, "torque_per_thrust_m: expected a number, above"),
        ("rotors.arm_length_m", 1e9, "arm_length_m: expected a number"),
        ("parameters.MC_ROLL_P", float("nan"), "MC_ROLL_P: expected a number"),
        ("parameters.MC_ROL_P", 1.0, "did you mean MC_ROLL_P"),
    ],
)
def test_a_plant_that_cannot_be_is_refused(field: str, value: object, said: str) -> None:
    """A file whose figures contradict each other is refused with the field's name."""
    with pytest.raises(FileError, match=said):
        plant("f550", {field: value})


def test_a_resistance_of_next_to_nothing_is_none() -> None:
    """The smaller root of the motor's equation cancels to zero there, and the battery divides by it."""
    tiny = plant("f550", {"rotors.motor_resistance_ohm": 1e-30})
    none = plant("f550", {"rotors.motor_resistance_ohm": 0.0})
    assert tiny.motor_speed_constant == none.motor_speed_constant
    battery = Battery(tiny)
    battery.draw([0.0] * tiny.rotors.count, 0.04)
    assert battery.full_speed_rad_s() > 0.0
