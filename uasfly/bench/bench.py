"""The whole bench: what is measured, in which order, and what comes out."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from uasfly.airframe import Airframe
from uasfly.bench.acados_process import AcadosProcess, AcadosUnavailableError, find_acados
from uasfly.bench.cases import NODES, SATURATED, most_nodes
from uasfly.bench.contestants import LIBRARY, AcadosSolver, Contestant, UasflySolver
from uasfly.bench.cycle import CycleFigures, measure_cycle
from uasfly.bench.detection import DetectionBench, DetectionFigures
from uasfly.bench.link import measure_link
from uasfly.bench.observer import ObserverFigures, measure_observer
from uasfly.bench.recommend import Recommendation, recommend
from uasfly.bench.solver import SolverRow, measure_solvers
from uasfly.bench.timing import Figures
from uasfly.control.native_library import load_solver
from uasfly.drivers.plan import FlightPlan
from uasfly.errors import UasflyError
from uasfly.files import find_file, load_file
from uasfly.mission import Mission
from uasfly.native import NativeUnavailableError
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario

BACKENDS = ("c", "vm", LIBRARY)
CLAIMED_NODES = (30, 60)  # sizes that get more blocks: their 99th percentiles are told in claims
QUICK_NODES = CLAIMED_NODES
SOLVER_SHARE = 0.6  # of the time that everything takes, for the progress bar
FLIGHT_FROM, BESIDE_FROM = SOLVER_SHARE + 0.1, SOLVER_SHARE + 0.25
DETECTION_ROUNDS = 24
ATTEMPTS = 2
OBSERVER_SAMPLES = 4000
LINK_S, CYCLES_S = 4.0, 16.0
SEED = 1
BUSY_SHARE = 0.95
HOVER: dict[str, object] = {"legs[0].duration_s": 300.0, "takeoff.height_m": 1.0, "legs[0].position_m": [0.0, 0.0, 1.0]}

T = TypeVar("T")
Told = Callable[[str, float], None]  # what is being measured, share that is done


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """What is to be measured.

    Attributes:
        airframe: model, weights, limits and settings.
        nodes: sizes of the solver's problem; all of them where empty.
        backends: of uasfly's solver, of `BACKENDS`; all that are to be had where empty.
        acados: folder with the package acados in it; None for where this Python finds it.
        quick: less of everything.
    """

    airframe: Airframe
    nodes: tuple[int, ...] = ()
    backends: tuple[str, ...] = ()
    acados: Path | None = None
    quick: bool = False

    @property
    def sizes(self) -> tuple[int, ...]:
        """The sizes that are measured."""
        return self.nodes or (QUICK_NODES if self.quick else NODES)

    def blocks(self, nodes: int) -> int:
        """How many blocks a size gets."""
        return 4 if nodes in CLAIMED_NODES and not self.quick else 1


@dataclass(slots=True)
class BenchResult:
    """What was measured; None for what was not.

    Attributes:
        rows: of the solver's table. acados: version of its package.
        observer, detection, cycle, link: times. recommended: what the airframe file should set.
        beside: the cycle's while markers are detected beside it at full load.
        own_share: of the time in which the solver ran, how much the processor really worked for it.
        remarks: what there is to say.
    """

    rows: list[SolverRow] = field(default_factory=list)
    acados: str | None = None
    observer: ObserverFigures | None = None
    detection: DetectionFigures | None = None
    cycle: CycleFigures | None = None
    beside: CycleFigures | None = None
    link: Figures | None = None
    recommended: Recommendation | None = None
    own_share: float | None = None
    remarks: list[str] = field(default_factory=list)

    def solver_p99_ms(self) -> dict[int, float]:
        """p99 of the solver that flies here, by size, with saturated inputs."""
        flown = next((name for name in ("c", "vm") if any(row.backend == name for row in self.rows)), "")
        return {row.n: row.figures.p99 for row in self.rows if row.backend == flown and row.case == SATURATED.name}


def run_bench(settings: BenchSettings, told: Told, *, solver_only: bool = False) -> BenchResult:
    """Measure everything; what fails on the way is told in the remarks, and the rest is there nevertheless.

    Raises:
        UasflyError: for settings that cannot be measured here.
    """
    result = bench_solver(settings, lambda text, done: told(text, done if solver_only else SOLVER_SHARE * done))
    if solver_only:
        return result
    told("observer", SOLVER_SHARE)
    result.observer = measure_observer(settings.airframe, OBSERVER_SAMPLES // (4 if settings.quick else 1))
    mission = load_file(find_file("mission", "hover"), Mission, HOVER)
    plant = load_file(find_file("plant", settings.airframe.plant), Plant)
    plan = FlightPlan(
        settings.airframe, mission, "nmpc", SEED, load_file(find_file("scenario", "calm"), Scenario), plant
    )
    told("link on loopback", SOLVER_SHARE + 0.05)
    duration_s = LINK_S / (2.0 if settings.quick else 1.0)
    result.link = _tried("link", lambda: measure_link(plan, duration_s), result.remarks)
    told("whole cycle in a live flight: take-off", FLIGHT_FROM)
    cycles = round(CYCLES_S * settings.airframe.controller.rate_hz / (4.0 if settings.quick else 1.0))

    def flown(done: float) -> None:
        told("whole cycle in a live flight", FLIGHT_FROM + (BESIDE_FROM - FLIGHT_FROM) * done)

    result.cycle = _tried("cycle", lambda: measure_cycle(plan, cycles, flown), result.remarks)
    _bench_detection(result, plan, cycles, settings, told)
    if result.cycle is not None:
        result.recommended = recommend(settings.airframe.controller, result.solver_p99_ms(), result.cycle.rest_p99_ms)
    return result


def _bench_detection(result: BenchResult, plan: FlightPlan, cycles: int, settings: BenchSettings, told: Told) -> None:
    """Marker detection, and the cycle beside it."""
    told("marker detection", BESIDE_FROM)
    rounds = DETECTION_ROUNDS // (4 if settings.quick else 1)
    try:
        bench = DetectionBench(SEED)
        detection = result.detection = bench.measure(rounds)
    except UasflyError as error:
        result.remarks.append(str(error))
        return

    def flown(done: float) -> None:
        told("whole cycle beside marker detection", BESIDE_FROM + (1.0 - BESIDE_FROM) * done)

    def measure() -> CycleFigures:
        with bench.running(detection):
            return measure_cycle(plan, cycles, flown)

    result.beside = _tried("cycle beside marker detection", measure, result.remarks)


def _tried(what: str, measure: Callable[[], T], remarks: list[str]) -> T | None:
    """A measurement in real time, tried again where a busy computer let the vehicle fall silent; None in the end."""
    for attempt in range(1, ATTEMPTS + 1):
        try:
            return measure()
        except UasflyError as error:
            if attempt == ATTEMPTS:
                remarks.append(f"the {what} was not measured: {error}")
    return None


def bench_solver(settings: BenchSettings, told: Told) -> BenchResult:
    """Measure the solver, beside acados where that is to be had.

    Raises:
        UasflyError: for a size or a backend that cannot be measured here.
    """
    for n in settings.sizes:
        if not 5 <= n <= most_nodes():
            raise UasflyError(f"--nodes {n}: expected numbers from 5 to {most_nodes()}")
    result = BenchResult()
    with contextlib.ExitStack() as stack:
        own = [UasflySolver(name) for name in _backends(settings.backends, result.remarks)]
        contestants: list[Contestant] = [*own]
        try:
            folder = find_acados(settings.acados)
            told("acados: generated and compiled", 0.0)
            process = stack.enter_context(AcadosProcess(folder))
            contestants.insert(1, AcadosSolver(process))
            result.acados = process.version
        except AcadosUnavailableError as reason:
            if settings.acados is not None:
                raise
            result.remarks.append(str(reason))
        costs = [n * settings.blocks(n) for n in settings.sizes for _ in range(2)]
        done = 0

        def tell(n: int, case: str) -> None:
            nonlocal done
            told(f"solver, N = {n}, {case}", sum(costs[:done]) / sum(costs))
            done += 1

        for row in measure_solvers(settings.airframe, settings.sizes, contestants, settings.blocks, tell):
            result.rows.append(row)
    result.own_share = sum(solver.processor_s for solver in own) / sum(solver.wall_s for solver in own)
    if result.own_share < BUSY_SHARE:
        result.remarks.append(
            f"something else ran on this computer: the solver had the processor {100 * result.own_share:.0f} % of the "
            "time; the p99 tell more of that than of uasfly"
        )
    return result


def _backends(wanted: Sequence[str], remarks: list[str]) -> list[str]:
    """Backends to be measured, the compiled one first."""
    for name in wanted:
        if name not in BACKENDS:
            raise UasflyError(f"--backend {name}: expected {', '.join(BACKENDS[:-1])} or {BACKENDS[-1]}")
    chosen = [name for name in BACKENDS if not wanted or name in wanted]
    if "c" in chosen:
        try:
            load_solver()
        except NativeUnavailableError as reason:
            if wanted:
                raise
            remarks.append(f"no compiled solver: {reason}")
            chosen.remove("c")
    if LIBRARY in chosen and importlib.util.find_spec(LIBRARY) is None:
        if wanted:
            raise UasflyError(f"--backend {LIBRARY}: not installed; pip install {LIBRARY}")
        chosen.remove(LIBRARY)
    return chosen
