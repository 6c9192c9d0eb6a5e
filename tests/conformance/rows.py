"""One row of the table: what PX4 does, what the simulated vehicle does, how far they may be apart, and why."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes:
        aspect, item: what is compared.
        recorded, simulated: the two values.
        difference, tolerance: as they are printed.
        within: whether the difference is allowed.
        reason: why the tolerance is what it is, or why the difference is meant.
    """

    aspect: str
    item: str
    recorded: str
    simulated: str
    difference: str
    tolerance: str
    within: bool
    reason: str = ""


def same(aspect: str, item: str, recorded: Hashable, simulated: Hashable, reason: str = "") -> Row:
    """Two values that have to be equal."""
    equal = recorded == simulated
    return Row(aspect, item, str(recorded), str(simulated), "none" if equal else "differs", "equal", equal, reason)


def same_order(aspect: str, item: str, recorded: Sequence[Hashable], simulated: Sequence[Hashable]) -> Row:
    """Two sequences that have to be equal; written out where they are not."""
    equal = list(recorded) == list(simulated)
    there, here = (f"{len(side)} of them" if equal else " > ".join(map(str, side)) for side in (recorded, simulated))
    return Row(aspect, item, there, here, "none" if equal else "differs", "equal", equal)


def close(
    aspect: str,
    item: str,
    values: Sequence[float],
    tolerance: float,
    unit: str = "",
    reason: str = "",
    digits: int = 2,
) -> Row:
    """Two numbers, recorded and simulated, that may differ by a tolerance; NaN is close to nothing."""
    recorded, simulated = values
    difference = simulated - recorded
    there, here, apart_by, bound = (
        _text(value, unit, digits) for value in (recorded, simulated, difference, tolerance)
    )
    return Row(aspect, item, there, here, apart_by, bound, abs(difference) <= tolerance, reason)


def at_most(
    aspect: str, item: str, recorded: str, simulated: float, limit: float, unit: str, reason: str = "", digits: int = 2
) -> Row:
    """A number of the simulated vehicle with an upper limit."""
    text, bound = _text(simulated, unit, digits), _text(limit, unit, digits)
    return Row(aspect, item, recorded, text, "", f"at most {bound}", simulated <= limit, reason)


def at_least(
    aspect: str, item: str, recorded: str, simulated: float, limit: float, unit: str, reason: str = "", digits: int = 2
) -> Row:
    """A number of the simulated vehicle with a lower limit."""
    text, bound = _text(simulated, unit, digits), _text(limit, unit, digits)
    return Row(aspect, item, recorded, text, "", f"at least {bound}", simulated >= limit, reason)


def apart(aspect: str, item: str, difference: float, limit: float, unit: str, reason: str = "", digits: int = 2) -> Row:
    """A measure of the difference itself, such as an RMS."""
    text, bound = _text(difference, unit, digits), _text(limit, unit, digits)
    return Row(aspect, item, "", "", text, bound, difference <= limit, reason)


def intended(aspect: str, item: str, recorded: str, simulated: str, found: bool, reason: str) -> Row:
    """A difference that is meant; `found` says whether the simulated vehicle does what is meant."""
    return Row(aspect, item, recorded, simulated, "meant" if found else "not as meant", "as meant", found, reason)


def _text(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}f} {unit}".rstrip()
