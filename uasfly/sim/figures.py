"""A plant's physical figures as symbols: one compiled function serves every plant of the same build.

A campaign that scatters masses and coefficients flies many plants; their equations differ in numbers only.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import casadi as ca

from uasfly.airframe import FileModel
from uasfly.sim.plant import Plant

Model = TypeVar("Model", bound=FileModel)

_USED = ("mass_kg", "inertia_kg_m2", "rotors", "drag", "gear")  # by the equations of motion


@dataclass(frozen=True, slots=True)
class Build:
    """What decides the form of a plant's equations; equal for all plants with equal equations.

    Attributes:
        layout, thrust_law: of the rotors. step_s: of the integration. plant: one of this build.
    """

    layout: str
    thrust_law: str
    step_s: float
    plant: Plant = field(compare=False, repr=False)

    @staticmethod
    def of(plant: Plant, step_s: float) -> Build:
        """The build of a plant."""
        return Build(plant.rotors.layout, plant.rotors.thrust_law, step_s, plant)


def plant_figures(plant: Plant) -> array[float]:
    """Values of the figures, in the order of `symbolic_plant`'s symbols."""
    values: list[float] = []

    def note(value: float) -> float:
        values.append(value)
        return value

    _replaced(plant, note, _USED)
    return array("d", values)


def symbolic_plant(plant: Plant) -> tuple[Plant, ca.SX]:
    """A plant of the same build with a symbol for every figure, and the symbols (n, 1); for equations only."""
    symbols: list[ca.SX] = []

    def symbol(_: float) -> ca.SX:
        symbols.append(ca.SX.sym(f"figure_{len(symbols)}"))
        return symbols[-1]

    return _replaced(plant, symbol, _USED), ca.vertcat(*symbols)


def _replaced(model: Model, replace: Callable[[float], object], names: tuple[str, ...] | None = None) -> Model:
    """A copy with every number replaced, in the order of the fields; nothing is validated."""
    update: dict[str, object] = {}
    for name in names or type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, FileModel):
            update[name] = _replaced(value, replace)
        elif isinstance(value, float):
            update[name] = replace(value)
        elif isinstance(value, tuple):
            update[name] = tuple(replace(number) for number in value)
    return model.model_copy(update=update)
