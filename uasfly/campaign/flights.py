"""From a campaign file to a list of flights, in an order that is always the same, every one of them checked."""

from __future__ import annotations

import itertools
import json
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel

from uasfly.airframe import Airframe
from uasfly.campaign.campaign_file import Campaign
from uasfly.campaign.draws import draw, scaled, value_at
from uasfly.campaign.identity import flight_id, model_digest
from uasfly.drivers.checking import refuse_infeasible
from uasfly.drivers.plan import FlightPlan
from uasfly.errors import FileError, UasflyError, shortened
from uasfly.file_problems import found
from uasfly.files import FileText, Kind, find_file, is_file, split_key
from uasfly.mission import Mission
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.wind.settings import BoundaryLayer, WindSettings
from uasfly.trajectories.mission_trajectory import MissionTrajectory

M = TypeVar("M", bound=BaseModel)
KEPT_MODELS = 512
BESIDE_THE_LEGS_S = 20.0  # take-off and landing, about
Named = Literal["airframe", "mission", "scenario"]
_FIELDS: dict[Named, str] = {"airframe": "airframes", "mission": "missions", "scenario": "scenarios"}


@dataclass(frozen=True, slots=True)
class Flight:
    """One flight of a campaign.

    Attributes:
        index: place in the campaign, from 0.
        id: digest of everything that decides the flight.
        airframe, mission, scenario: as the campaign file names them.
        controller, seed: as on the command line.
        values: fields that the campaign changes, with their values in this flight, in the order of `Overrides.keys`.
        wind_m_s: see `wind_speed_m_s`.
    """

    index: int
    id: str
    airframe: str
    mission: str
    scenario: str
    controller: str
    seed: int
    values: tuple[tuple[str, object], ...]
    wind_m_s: float


class FlightList:
    """The flights of a campaign file, and the plan of each."""

    def __init__(self, path: Path, say: Callable[[str], None]) -> None:
        """Read the campaign and the files that it names, and check every flight.

        Args:
            path: the campaign file.
            say: called with warnings about missions, each once.

        Raises:
            FileError: a file or a field cannot be used. UasflyError: an airframe cannot fly a mission.
        """
        self.path = path
        self._text = FileText(path)
        self.campaign = self._text.checked(Campaign)
        self._files: dict[str, FileText] = {}
        self._models: dict[tuple[str, ...], tuple[Any, str]] = {}
        self._durations_s: dict[tuple[str, str], float] = {}  # of airframe and mission that fit
        self._said: set[str] = set()
        self._say = say
        self._located: dict[tuple[Named, str], str] = {}
        self._locate_all()
        self.flights = list(self._expand())

    def plan(self, flight: Flight) -> FlightPlan:
        """What is flown, as `uasfly rehearse` would put it together."""
        return self._resolve(flight)[0]

    def duration_s(self, flight: Flight) -> float:
        """About how long a flight is in the air, of its own time [s]."""
        digests = self._resolve(flight)[1]
        return self._durations_s[digests[0], digests[1]]

    def command(self, flight: Flight) -> str:
        """The command that repeats a flight, for the shell; files are named as seen from the working directory."""
        words = ["uasfly", "rehearse", self._located["mission", flight.mission]]
        words += ["--airframe", self._located["airframe", flight.airframe]]
        words += ["--scenario", self._located["scenario", flight.scenario]]
        words += ["--seed", str(flight.seed), "--controller", flight.controller]
        for key, value in flight.values:
            words += ["--set", f"{key}={json.dumps(value)}"]
        return shlex.join(words)

    def _locate_all(self) -> None:
        """Find the files; a name beside the campaign file comes before the same name elsewhere."""
        problems = []
        for kind, field in _FIELDS.items():
            for number, name in enumerate(getattr(self.campaign, field)):
                beside = self.path.parent / name
                try:
                    if is_file(beside):
                        self._located[kind, name] = str(beside)
                    else:
                        find_file(kind, name)
                        self._located[kind, name] = name
                except FileError as error:
                    line = self._text.line(field, number)
                    problems.append(f"line {line}: {field}[{number}] {shortened(name)}: {error.problems[0]}")
        if problems:
            raise FileError(str(self.path), problems)

    def _expand(self) -> Iterator[Flight]:
        campaign, overrides = self.campaign, self.campaign.overrides
        sweeps = itertools.product(*([(key, value) for value in values] for key, values in overrides.swept.items()))
        changes = [(*overrides.fixed.items(), *swept) for swept in sweeps]
        names = itertools.product(campaign.airframes, campaign.missions, campaign.scenarios, campaign.controllers)
        combinations = itertools.product(names, changes, campaign.seeds.all())
        for index, ((airframe, mission, scenario, controller), values, seed) in enumerate(combinations):
            flight = Flight(index, "", airframe, mission, scenario, controller, seed, values, 0.0)
            if overrides.scattered:
                flight = replace(flight, values=(*values, *self._draw(flight)))
            plan, digests = self._resolve(flight)
            self._refuse_infeasible(plan, digests)
            assert plan.scenario is not None
            wind = wind_speed_m_s(plan.scenario.wind)
            yield replace(flight, id=flight_id(digests, controller, seed), wind_m_s=wind)

    def _draw(self, flight: Flight) -> tuple[tuple[str, object], ...]:
        """Scattered fields of a flight, which has the fixed and swept ones already."""
        drawn: list[tuple[str, object]] = []
        for key, scatter in self.campaign.overrides.scattered.items():
            value: object = draw(key, scatter, flight.seed)
            if scatter.relative:
                assert isinstance(value, float)
                base = self._base_value(key, flight)
                try:
                    value = scaled(base, value)
                except ValueError as error:
                    line = self._text.line("overrides", "scattered", key)
                    problem = f"line {line}: overrides.scattered.{shortened(key)}: {error}, found {found(base)}"
                    raise FileError(str(self.path), [problem]) from None
            drawn.append((key, value))
        return tuple(drawn)

    def _base_value(self, key: str, flight: Flight) -> object:
        plan = self._resolve(flight)[0]
        kind, _, rest = key.partition(".")
        model = {
            "airframe": plan.airframe,
            "mission": plan.mission,
            "scenario": plan.scenario,
            "plant": plan.plant,
        }[kind]
        assert model is not None
        return value_at(model.model_dump(mode="json"), split_key(rest))

    def _resolve(self, flight: Flight) -> tuple[FlightPlan, list[str]]:
        """The plan, and the digests of airframe, mission, scenario and plant."""
        by_kind: dict[str, dict[str, object]] = {"airframe": {}, "mission": {}, "scenario": {}, "plant": {}}
        for key, value in flight.values:
            kind, _, rest = key.partition(".")
            by_kind[kind][rest] = value
        the_airframe, first = self._model("airframe", self._located["airframe", flight.airframe], Airframe, by_kind)
        the_mission, second = self._model("mission", self._located["mission", flight.mission], Mission, by_kind)
        the_scenario, third = self._model("scenario", self._located["scenario", flight.scenario], Scenario, by_kind)
        plant, fourth = self._model("plant", the_airframe.plant, Plant, by_kind)
        plan = FlightPlan(the_airframe, the_mission, flight.controller, flight.seed, the_scenario, plant)
        return plan, [first, second, third, fourth]

    def _model(
        self, kind: Kind, name: str, model: type[M], by_kind: Mapping[str, Mapping[str, object]]
    ) -> tuple[M, str]:
        overrides = by_kind[kind]
        key = (kind, name, json.dumps(list(overrides.items())))
        kept = self._models.get(key)
        if kept is None:
            text = self._file(kind, name)
            try:
                value = text.checked(model, overrides)
            except FileError as error:
                text.checked(model)  # a file that is wrong by itself says so
                raise self._blamed(error, kind, overrides) from None
            if len(self._models) >= KEPT_MODELS:  # scattered values come once or a few times
                self._models.clear()
            kept = self._models[key] = (value, model_digest(value))
        return kept

    def _file(self, kind: Kind, name: str) -> FileText:
        path = find_file(kind, name)
        if str(path) not in self._files:
            self._files[str(path)] = FileText(path)
        return self._files[str(path)]

    def _blamed(self, error: FileError, kind: Kind, overrides: Mapping[str, object]) -> FileError:
        """The error of a file, put where it comes from: where an override does it, on its line of the campaign file."""
        problems = []
        for problem in error.problems:
            if not problem.startswith("--set"):
                return error
            text = problem.removeprefix("--set:").removeprefix("--set").strip()
            key = next((key for key in overrides if text.startswith((key, *_enclosing(key)))), None)
            section = self._section(f"{kind}.{key}")
            where = f"line {self._text.line('overrides', section, f'{kind}.{key}')}: overrides.{section}.{kind}."
            what = f" (value: {_shown(overrides[key])}, file: {error.path})" if key is not None else f" ({error.path})"
            problems.append(f"{where}{text}{what}")
        return FileError(str(self.path), problems)

    def _section(self, key: str) -> str:
        overrides = self.campaign.overrides
        return "swept" if key in overrides.swept else "scattered" if key in overrides.scattered else "fixed"

    def _refuse_infeasible(self, plan: FlightPlan, digests: list[str]) -> None:
        pair = (digests[0], digests[1])
        if pair in self._durations_s:
            return

        def say(text: str) -> None:
            if text not in self._said:
                self._said.add(text)
                self._say(text)

        try:
            refuse_infeasible(plan.mission, plan.airframe, say)
        except UasflyError as error:
            line = self._text.line("missions")
            raise UasflyError(f"{self.path}: line {line}: {error}") from None
        start = np.array((0.0, 0.0, plan.mission.takeoff.height_m))
        trajectory = MissionTrajectory(plan.mission, plan.airframe.limits, start, 0.0)
        self._durations_s[pair] = trajectory.duration_s + BESIDE_THE_LEGS_S


def wind_speed_m_s(wind: WindSettings) -> float:
    """One figure for the wind of a scenario: the faster of mean wind and jets [m/s].

    The mean wind counts with its horizontal speed, with a boundary layer with that at 10 m, as forecasts say it; a jet
    counts with its speed on the axis where it is aimed at. Gusts come on top.
    """
    mean = wind.mean
    speeds = [mean.speed_at_10_m_m_s if isinstance(mean, BoundaryLayer) else mean.w20_m_s]
    for jet in wind.jets:
        distances = [distance for distance, _ in jet.axis_speed]
        figures = [speed for _, speed in jet.axis_speed]
        speeds.append(_interpolated(jet.distance_m, distances, figures))
    return round(max(speeds), 6)


def _interpolated(at: float, places: list[float], values: list[float]) -> float:
    """As the jets themselves: the first speed before the first place, decay with distance behind the last."""
    if at >= places[-1]:
        return values[-1] * places[-1] / at
    for (x0, y0), (x1, y1) in itertools.pairwise(zip(places, values, strict=True)):
        if x0 <= at <= x1:
            return y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    return values[0]


def _enclosing(key: str) -> tuple[str, ...]:
    """Blocks around a field, innermost first: what pydantic blames may be a block."""
    parts = key.replace("[", ".[").split(".")
    return tuple(".".join(parts[:n]).replace(".[", "[") for n in range(len(parts) - 1, 0, -1))


def _shown(value: object) -> str:
    return shortened(json.dumps(value))
