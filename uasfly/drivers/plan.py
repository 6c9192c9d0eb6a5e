"""What is to be flown: airframe, mission, scenario, seed and controller, read from files and put together."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

from uasfly.airframe import Airframe
from uasfly.control.protocol import Controller
from uasfly.drivers.sight import NO_SIGHT, Sight, SightOptions, load_sight
from uasfly.errors import UasflyError, shortened
from uasfly.files import find_file, load_file, parse_overrides
from uasfly.flight.choices import Engage
from uasfly.flight.pilot import Pilot
from uasfly.mission import Mission
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario

ControllerName = Literal["nmpc", "pid", "pid_dd", "pid_dd_wind"]
CONTROLLERS = get_args(ControllerName)


@dataclass(frozen=True, slots=True)
class FlightPlan:
    """Everything that decides how a flight goes."""

    airframe: Airframe
    mission: Mission
    controller: str
    seed: int
    scenario: Scenario | None = None
    plant: Plant | None = None
    sight: Sight | None = None

    def description(self) -> dict[str, Any]:
        """Plain data for the log."""
        return {
            "airframe": self.airframe.model_dump(mode="json"),
            "mission": self.mission.model_dump(mode="json"),
            "controller": self.controller,
            "seed": self.seed,
            "scenario": None if self.scenario is None else self.scenario.model_dump(mode="json"),
            "plant": None if self.plant is None else self.plant.model_dump(mode="json"),
            "sight": None if self.sight is None else self.sight.description(),
        }

    def identity(self) -> dict[str, object]:
        """Names for the summary."""
        return {
            "mission": self.mission.name,
            "airframe": self.airframe.name,
            "controller": self.controller,
            "scenario": None if self.scenario is None else self.scenario.name,
            "seed": self.seed,
            "camera": None if self.sight is None else self.sight.name,
        }


def load_plan(
    mission: str,
    airframe: str,
    *,
    controller: str = "nmpc",
    seed: int = 1,
    scenario: str | None = None,
    settings: list[str] | None = None,
    sight: SightOptions = NO_SIGHT,
) -> FlightPlan:
    """Read and check the files of a flight.

    Args:
        mission: name of a shipped file or a path.
        airframe: name of a shipped file or a path.
        controller: one of `CONTROLLERS`.
        seed: of everything random in the simulation.
        scenario: name of a shipped file or a path; without one there is no simulation.
        settings: `--set` texts, `airframe.model.drag_1_s=[0.3, 0.3, 0.3]`, `mission.takeoff.height_m=2` or
            `scenario.link.telemetry_latency_s=0.02`.
        sight: which camera and bundles.

    Raises:
        FileError: for a file that cannot be used. UasflyError: for a flag that cannot be used.
    """
    if controller not in CONTROLLERS:
        raise UasflyError(f"--controller: expected one of {', '.join(CONTROLLERS)}, found {shortened(controller)!r}")
    by_file = _split_settings(settings or [])
    airframe_model = load_file(find_file("airframe", airframe), Airframe, by_file["airframe"])
    mission_model = load_file(find_file("mission", mission), Mission, by_file["mission"])
    scenario_model, plant = None, None
    if scenario is not None:
        scenario_model = load_file(find_file("scenario", scenario), Scenario, by_file["scenario"])
        plant = load_file(find_file("plant", airframe_model.plant), Plant, by_file["plant"])
    elif by_file["scenario"] or by_file["plant"]:
        raise UasflyError("--set scenario.* and plant.* need the built-in simulation (--sim or rehearse)")
    seen = load_sight(sight, scenario_model, mission_bundle(mission_model))
    return FlightPlan(airframe_model, mission_model, controller, seed, scenario_model, plant, seen)


def mission_bundle(mission: Mission) -> str | None:
    """Name of the bundle that a mission flies by, None for none."""
    return None if mission.marker is None else mission.marker.bundle


def build_pilot(
    plan: FlightPlan,
    engage: Engage,
    timer: Callable[[], float] | None,
    *,
    late_counts: bool,
    preflight: bool = False,
    only_check: bool = False,
) -> Pilot:
    """Observer, controller and phases for a plan; takes some seconds where the solver is not compiled yet.

    Args:
        plan: what to fly.
        engage: who brings the vehicle into offboard.
        timer: measures the solver (perf_counter); None leaves it out.
        late_counts: whether a solve that took too long by the timer is replaced; not where time is simulated.
        preflight: see `Pilot`.
        only_check: see `Pilot`.
    """
    from uasfly.observer.observer import Observer

    controller = build_controller(plan, timer, late_counts=late_counts)
    observer = Observer(plan.airframe, 0 if plan.sight is None else len(plan.sight.bundles))
    flies_by = None
    if plan.sight is not None and plan.mission.marker is not None:
        flies_by = plan.sight.bundles[0].marker_id
    return Pilot(
        plan.airframe,
        plan.mission,
        observer,
        controller,
        engage,
        preflight=preflight,
        only_check=only_check,
        marker_id=flies_by,
    )


def build_controller(plan: FlightPlan, timer: Callable[[], float] | None, *, late_counts: bool) -> Controller:
    """The controller of a plan, see `build_pilot`."""
    from uasfly.control.controller import NmpcController, PidController, PidDdController

    if plan.controller == "nmpc":
        return NmpcController(plan.airframe, timer=timer, deadline_s=None if late_counts else math.inf)
    if plan.controller == "pid":
        return PidController(plan.airframe, timer=timer)
    return PidDdController(plan.airframe, timer=timer, wind=plan.controller == "pid_dd_wind")


def _split_settings(settings: list[str]) -> dict[str, dict[str, object]]:
    by_file: dict[str, dict[str, object]] = {"airframe": {}, "mission": {}, "scenario": {}, "plant": {}}
    for key, value in parse_overrides(settings).items():
        kind, _, rest = key.partition(".")
        if kind not in by_file or not rest:
            raise UasflyError(
                f"--set {shortened(key)}: expected a key that begins with {', '.join(f'{k}.' for k in by_file)}, "
                "for example --set airframe.limits.tilt_deg=25"
            )
        by_file[kind][rest] = value
    return by_file
