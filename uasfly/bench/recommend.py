"""What an airframe file should set for this computer: rate, horizon and nodes from what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

from uasfly.airframe import ControllerSettings

RATES_HZ = (100.0, 50.0, 40.0, 25.0, 20.0, 10.0, 5.0)  # PX4's motion comes at 100 Hz: more would answer to nothing new
NODES = (60, 40, 30, 20, 10)  # more change nothing that can be measured in the tracking
FEW_NODES = 20  # rather a slower cycle than fewer nodes than this
HOLDS_SHARE = 0.5  # of a period that one cycle in a hundred may exceed at a rate that this computer can hold
SET_SHARE = 0.4  # the same for what is recommended: what else runs on a companion computer needs the rest


@dataclass(frozen=True, slots=True)
class Recommendation:
    """Settings for the airframe file.

    Attributes:
        horizon_s, nodes, rate_hz: fields of `controller`.
        holds_hz: the rate that this computer can hold with them.
        fits: whether even the least of it leaves enough time; False on a computer that is too slow.
        why: for people.
    """

    horizon_s: float
    nodes: int
    rate_hz: float
    holds_hz: float
    fits: bool
    why: str

    def as_dict(self) -> dict[str, object]:
        """Plain data."""
        return asdict(self)


def cycle_p99_ms(nodes: int, solver_p99_ms: Mapping[int, float], rest_p99_ms: float) -> float | None:
    """A cycle with so many nodes [ms]: the rest of the cycle and the solver where inputs saturate, each at its p99.

    A size that was not measured takes as long as the next larger one that was; None where there is none.
    """
    larger = [size for size in solver_p99_ms if size >= nodes]
    return rest_p99_ms + solver_p99_ms[min(larger)] if larger else None


def holdable_rate(cycle_ms: float) -> float:
    """The largest of `RATES_HZ` at which a cycle of this length [ms] takes at most half of a period; else the least."""
    return next((rate for rate in RATES_HZ if cycle_ms <= HOLDS_SHARE * 1e3 / rate), RATES_HZ[-1])


def recommend(
    settings: ControllerSettings, solver_p99_ms: Mapping[int, float], rest_p99_ms: float
) -> Recommendation | None:
    """Settings under which a cycle's p99 takes at most 40 % of a period.

    The rate is the airframe's own, whose weights are tuned for it, or the next lower one that leaves time for 20
    nodes; then as many nodes as fit, up to 60.

    Args:
        settings: what the airframe file has now; its horizon and first interval stay.
        solver_p99_ms: p99 of the whole step with saturated inputs by size.
        rest_p99_ms: p99 of a cycle without the solver.

    Returns:
        None where no size was measured.
    """
    costs = {
        n: cost
        for n in NODES
        if n * settings.first_interval_s <= settings.horizon_s
        and (cost := cycle_p99_ms(n, solver_p99_ms, rest_p99_ms)) is not None
    }
    if not costs:
        return None
    rates = (settings.rate_hz, *(rate for rate in RATES_HZ if rate < settings.rate_hz))
    least = min(FEW_NODES, max(costs))
    for rate in rates:
        room_ms = SET_SHARE * 1e3 / rate
        fitting = [n for n, cost in costs.items() if cost <= room_ms and (n >= least or rate == rates[-1])]
        if fitting:
            return _recommendation(settings, max(fitting), rate, costs[max(fitting)], fits=True)
    nodes = min(costs)
    return _recommendation(settings, nodes, rates[-1], costs[nodes], fits=False)


def _recommendation(
    settings: ControllerSettings, nodes: int, rate_hz: float, cycle_ms: float, *, fits: bool
) -> Recommendation:
    share = 100.0 * cycle_ms * rate_hz * 1e-3
    why = f"99 of 100 cycles take less than {cycle_ms:.2f} ms, {share:.0f} % of a period at {rate_hz:g} Hz"
    if not fits:
        why += "; this computer is too slow: fly without the nmpc (--controller pid) or on a faster one"
    elif rate_hz < settings.rate_hz:
        why += f"; {settings.rate_hz:g} Hz would leave no time for {FEW_NODES} nodes"
    elif nodes == NODES[0]:
        why += "; more nodes would not track better"
    return Recommendation(settings.horizon_s, nodes, rate_hz, holdable_rate(cycle_ms), fits, why)
