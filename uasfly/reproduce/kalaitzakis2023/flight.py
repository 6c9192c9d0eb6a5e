"""One flight of an experiment, and what rows and pictures need of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from uasfly.drivers.plan import FlightPlan
from uasfly.drivers.rehearse import rehearse
from uasfly.drivers.watching import Cycle
from uasfly.errors import UasflyError
from uasfly.flight.tracking_errors import MarkerDatum
from uasfly.messages import Array, FlightMode, OdometrySample, Phase, Sample, Status, TruthSample

CYCLES_PER_REPORT = 250


@dataclass(frozen=True, slots=True)
class Record:
    """The legs of a flight, a row a control cycle.

    Attributes:
        summary: as `uasfly rehearse` gives it; the RMS figures are from here.
        offboard_s: when the vehicle first was in offboard, on the clock of `time_s`; jets blow by it.
        time_s: (n,). truth, reference, estimate, gnss: (n, 3) m, world; `gnss` as last heard.
        placed: (n, 3) m, the truth as it lies in the filter's world, which hangs on the marker; NaN without a marker.
        force_estimated, force_true: (n, 3) m/s^2.
        solve_ms: (k,) times of the solver, of all the flight.
    """

    summary: Mapping[str, Any]
    offboard_s: float
    time_s: Array
    truth: Array
    reference: Array
    estimate: Array
    gnss: Array
    placed: Array
    force_estimated: Array
    force_true: Array
    solve_ms: Array

    @property
    def error(self) -> Array:
        """(n, 3) m, true minus wanted; as seen from the marker where there is one."""
        return np.where(np.isfinite(self.placed), self.placed, self.truth) - self.reference

    @property
    def since_start_s(self) -> Array:
        """(n,) s since the legs began."""
        return np.asarray(self.time_s - self.time_s[0])

    def during(self, begin_s: float, end_s: float) -> Array:
        """(n,) which rows are between two times on the stop watch that starts with offboard."""
        since = self.time_s - self.offboard_s
        return np.asarray((since >= begin_s) & (since <= end_s))


class _Recorder:
    """Keeps what a rehearsal shows."""

    def __init__(self, report: Callable[[float], None]) -> None:
        self._report = report
        self._cycles = 0
        self._offboard_s = math.nan
        self._gnss = np.full(3, math.nan)
        self._times: list[float] = []
        self._rows: list[tuple[Array, ...]] = []
        self._solve_ms: list[float] = []

    def watch(self, status: Status, cycle: Cycle) -> None:
        self._cycles += 1
        if cycle.solve_ms is not None:
            self._solve_ms.append(cycle.solve_ms)
        if self._cycles % CYCLES_PER_REPORT == 0:
            self._report(status.progress)

    def witness(self, status: Status, samples: tuple[Sample, ...], datum: MarkerDatum | None) -> None:
        if math.isnan(self._offboard_s) and status.mode is FlightMode.OFFBOARD:
            self._offboard_s = status.time_s
        truth = None
        for sample in samples:
            if isinstance(sample, OdometrySample):
                self._gnss = sample.position_in_world
            elif isinstance(sample, TruthSample):
                truth = sample
        estimate, reference = status.estimate, status.reference_position_in_world
        flying = status.phase is Phase.LEGS and status.leg_started
        if not flying or truth is None or estimate is None or reference is None:
            return
        true = truth.position_in_world
        placed = np.full(3, math.nan) if datum is None else datum.placed(true)
        self._times.append(status.time_s)
        forces = (estimate.force_in_world, truth.force_in_world)
        self._rows.append((true, np.array(reference), estimate.position_in_world, self._gnss, placed, *forces))

    def record(self, summary: dict[str, Any]) -> Record:
        truth, reference, estimate, gnss, placed, estimated, true = np.array(self._rows).transpose(1, 0, 2)
        return Record(
            summary=summary,
            offboard_s=self._offboard_s,
            time_s=np.array(self._times),
            truth=truth,
            reference=reference,
            estimate=estimate,
            gnss=gnss,
            placed=placed,
            force_estimated=estimated,
            force_true=true,
            solve_ms=np.array(self._solve_ms),
        )


def fly(plan: FlightPlan, report: Callable[[float], None] = lambda _: None) -> Record:
    """Fly a plan.

    Args:
        plan: what to fly.
        report: told the share of the legs that is done, now and then.

    Raises:
        UasflyError: the mission was not flown to its end, or without markers where there are some.
    """
    recorder = _Recorder(report)
    summary = rehearse(plan, watch=recorder.watch, witness=recorder.witness)
    if summary["outcome"] != "completed":
        raise UasflyError(
            f"{plan.mission.name}, seed {plan.seed}: expected the mission to be flown to its end, "
            f"found it {summary['outcome']}: {summary['reason'] or 'no reason given'}"
        )
    if plan.sight is not None and summary["by_marker"] is None:
        raise UasflyError(f"{plan.mission.name}, seed {plan.seed}: expected markers to be seen, found none")
    return recorder.record(summary)
