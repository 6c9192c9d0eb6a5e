"""Kalaitzakis & Vitzilaios 2023: the experiments of the paper that uasfly implements, flown in the simulated plant.

Each experiment is a shipped mission in a shipped scenario, as `uasfly rehearse` flies it; figures are means of five
seeds. What differs from the paper's experiments, or is not stated there:

- Vehicle: plants that behave like the paper's identified f550 and Aurelia X6. The airframe files are the shipped ones:
  weights, limits and horizon grid are uasfly's, not the paper's, whose +-0.1 rad could not hold its own blower.
- Position: 1 cm of white noise stands for the motion capture of the paper's laboratory; tracking is truth minus
  reference, all three axes together.
- Markers: poses from the noise model that is held to rendered frames by a test; rendering the frames would take as long
  as the flights do. `uasfly rehearse marker_hover --scenario gnss_degraded --camera vga` flies by rendered ones.
- GNSS walks by eq. 11, scaled to 1.28 m RMS expected over 137 s; what a flight meets differs from seed to seed.
  How wrong GNSS was when the markers were first seen decides where they, and everything, are in the world, and is not
  stated. Flown are a walk from the start on (the error as seen from the marker is the one that can be kept small) and
  one that begins when the vehicle stands above the markers.
- Blowers: speeds as stated, widths and turbulence (15 %) assumed; the gust of the spirals is that of the side gust.
- Field: the wind is not stated; the gusts of 8 m/s at 10 m blow from the side.
- Solver times: of this computer.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from uasfly.reproduce.kalaitzakis2023 import experiments as e
from uasfly.reproduce.kalaitzakis2023 import pictures
from uasfly.reproduce.kalaitzakis2023.flight import Record, fly
from uasfly.reproduce.kalaitzakis2023.results import FORCES_M_S2, TRACKING_CM, Records, all_rows
from uasfly.reproduce.rows import Progress, Reproduction
from uasfly.sim.scenario import Scenario

PAPER = "kalaitzakis2023"


def reproduce(seed: int, progress: Progress) -> Reproduction:
    """Fly all experiments with this seed and the ones after it, and compare with the paper."""
    plans = e.flight_plans(seed)
    records: dict[str, list[Record]] = {}
    for number, ((name, its_seed), plan) in enumerate(plans.items()):
        text = f"{e.EXPERIMENTS[name].title}, seed {its_seed}"

        def report(share: float, text: str = text, number: int = number) -> None:
            progress(text, (number + share) / len(plans))

        report(0.0)
        records.setdefault(name, []).append(fly(plan, report))
    progress("all flown", 1.0)
    blowers = plans[e.BLOWER, seed].scenario
    assert blowers is not None
    return compare(records, blowers)


def compare(records: Records, blowers: Scenario) -> Reproduction:
    """Rows and pictures of flights of all experiments; `blowers`: see `all_rows`."""
    return Reproduction(PAPER, all_rows(records, blowers), _pictures(records, blowers))


def _pictures(records: Records, blowers: Scenario) -> dict[str, Callable[[Path], None]]:
    """Of each experiment's first flight; the boxes of all."""
    first = {name: flights[0] for name, flights in records.items()}
    schedules = [jet.schedule for jet in blowers.wind.jets]
    figures = []
    for (number, axis), force in FORCES_M_S2.items():
        schedule = schedules[number]
        assert schedule.end_s is not None
        figures.append((axis, schedule.start_s, schedule.end_s, force))
    tracked = {e.EXPERIMENTS[name].title: (records[name], paper) for name, paper in TRACKING_CM.items()}
    spirals = {e.EXPERIMENTS[name].title: first[name] for name in e.SPIRALS}
    over_markers = "Hover over markers, GNSS walks away once they are in sight"
    drawn: dict[str, Callable[[Path], None]] = {
        "localisation": partial(pictures.localisation, first[e.MARKERS_SOUND], over_markers),
        "disturbance": partial(pictures.forces, first[e.BLOWER], figures),
        "spirals": partial(pictures.paths, spirals),
        "errors": partial(pictures.boxes, tracked),
    }
    for name in (e.BLOWER, e.HEAD, e.SIDE, e.FIELD):
        title = e.EXPERIMENTS[name].title
        drawn[f"position_{name}"] = partial(pictures.positions, first[name], title[0].upper() + title[1:])
    return drawn
