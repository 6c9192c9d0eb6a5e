"""Scattered values: each draw depends on the seed and the field's name alone, not on order, number or place."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from uasfly.campaign.campaign_file import LogNormal, Normal, Scatter, Uniform
from uasfly.yaml_text import DataPath

DIGITS = 6  # significant: what is flown is what the command says, and a command is for people too


def draw(field: str, scatter: Scatter, seed: int) -> float:
    """The value of a scattered field in the flights with this seed.

    Flights that differ in airframe, mission, scenario, controller or a swept value meet the same draws: they are
    compared under the same conditions.

    Args:
        field: its whole name (plant.mass_kg).
        scatter: the distribution.
        seed: of the flight.
    """
    words = np.frombuffer(hashlib.sha256(field.encode()).digest(), dtype="<u4")
    generator = np.random.default_rng([seed, *words.tolist()])
    match scatter:
        case Normal():
            value = scatter.mean + scatter.sigma * float(generator.standard_normal())
        case Uniform():
            value = scatter.low + (scatter.high - scatter.low) * float(generator.random())
        case LogNormal():
            value = scatter.median * math.exp(scatter.sigma * float(generator.standard_normal()))
        case _:
            raise TypeError(scatter)
    if scatter.least is not None:
        value = max(scatter.least, value)
    if scatter.most is not None:
        value = min(scatter.most, value)
    return significant(value)


def significant(value: float) -> float:
    """A number with as many digits as are kept."""
    return float(f"{value:.{DIGITS}g}")


def scaled(base: object, factor: float) -> object:
    """A number, or all numbers of a list, times a factor.

    Raises:
        ValueError: where there is something else, or nothing.
    """
    if isinstance(base, (int, float)) and not isinstance(base, bool):
        return significant(base * factor)
    if isinstance(base, list) and base:
        return [scaled(item, factor) for item in base]
    raise ValueError("relative needs a number, or a list of numbers, in the file")


def value_at(data: Any, path: DataPath) -> object:
    """What stands at a path of plain data; None where nothing does."""
    for part in path:
        inside = (isinstance(data, Mapping) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        )
        if not inside:
            return None
        data = data[part]
    return data
