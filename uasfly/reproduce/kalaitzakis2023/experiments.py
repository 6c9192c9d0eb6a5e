"""What is flown: the paper's experiments as shipped missions in shipped scenarios, each with several seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from uasfly.drivers.plan import FlightPlan, load_plan
from uasfly.drivers.sight import MODEL, NO_SIGHT, SightOptions
from uasfly.reproduce.rows import SEEDS

FIELD_WIND_M_S = 8.0  # at 10 m, as in the scenario gusty
PAPER_NODES, PAPER_INTERVAL_S = 60, 0.05


@dataclass(frozen=True, slots=True)
class Experiment:
    """One of the paper's experiments.

    Attributes:
        title: for rows and pictures. mission, scenario, airframe: shipped files.
        settings: as with `--set`. camera: whether markers are looked for. once: whether one seed is enough.
    """

    title: str
    mission: str
    scenario: str
    airframe: str = "f550"
    settings: tuple[str, ...] = ()
    camera: bool = False
    once: bool = False


_WALKING_AT_ONCE = "scenario.sensors.gnss.walk_from_s=null"
_GUSTY_SIDE = (f"scenario.wind.mean.speed_at_10_m_m_s={FIELD_WIND_M_S:g}", "scenario.wind.mean.toward_deg=90")
_PAPER_GRID = (
    f"airframe.controller.nodes={PAPER_NODES}",
    f"airframe.controller.first_interval_s={PAPER_INTERVAL_S:g}",
)

MARKERS, MARKERS_SOUND, BLOWER, HEAD, SIDE = "markers", "markers_sound", "blower", "head", "side"
SPIRAL_CALM, SPIRAL_SIDE, SPIRAL_UP, SPIRAL_DOWN = "spiral_calm", "spiral_side", "spiral_up", "spiral_down"
FIELD, PAPER_GRID = "field", "paper_grid"
SPIRALS = (SPIRAL_CALM, SPIRAL_SIDE, SPIRAL_UP, SPIRAL_DOWN)

EXPERIMENTS: Mapping[str, Experiment] = {
    MARKERS: Experiment(
        "hover over markers", "marker_hover", "gnss_degraded", settings=(_WALKING_AT_ONCE,), camera=True
    ),
    MARKERS_SOUND: Experiment("hover over markers", "marker_hover", "gnss_degraded", camera=True),
    BLOWER: Experiment("hover before a blower", "hover", "blower_hover"),
    HEAD: Experiment("back and forth, head wind", "back_and_forth", "head_wind"),
    SIDE: Experiment("back and forth, side gust", "back_and_forth", "side_gust"),
    SPIRAL_CALM: Experiment("spiral, calm", "spiral", "calm"),
    SPIRAL_SIDE: Experiment("spiral, side gust", "spiral", "spiral_side"),
    SPIRAL_UP: Experiment("spiral, gust 20 deg up", "spiral", "spiral_up"),
    SPIRAL_DOWN: Experiment("spiral, gust 20 deg down", "spiral", "spiral_down"),
    FIELD: Experiment(
        "field hover by a board",
        "marker_standoff",
        "gnss_degraded",
        airframe="aurelia_x6",
        settings=_GUSTY_SIDE,
        camera=True,
    ),
    PAPER_GRID: Experiment("NMPC step", "hover", "blower_hover", settings=_PAPER_GRID, once=True),
}


def flight_plans(first_seed: int, seeds: int = SEEDS) -> dict[tuple[str, int], FlightPlan]:
    """Everything that is flown, by experiment and seed."""
    plans: dict[tuple[str, int], FlightPlan] = {}
    for name, experiment in EXPERIMENTS.items():
        plan = flight_plan(experiment, first_seed)
        for seed in range(first_seed, first_seed + (1 if experiment.once else seeds)):
            plans[name, seed] = replace(plan, seed=seed)
    return plans


def flight_plan(experiment: Experiment, seed: int, settings: tuple[str, ...] = ()) -> FlightPlan:
    """One flight of an experiment; further settings change it."""
    return load_plan(
        experiment.mission,
        experiment.airframe,
        seed=seed,
        scenario=experiment.scenario,
        settings=[*experiment.settings, *settings],
        sight=SightOptions(MODEL) if experiment.camera else NO_SIGHT,
    )
