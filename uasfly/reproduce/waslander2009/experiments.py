"""The paper's experiments and their rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.frames import euler_from_quaternion, rotation_matrix
from uasfly.messages import Array
from uasfly.reproduce.rows import Progress, Reproduction, Row
from uasfly.reproduce.waslander2009 import pictures, vehicle
from uasfly.reproduce.waslander2009.flight import MakeOnboard, PaperFlight, Record, fly
from uasfly.reproduce.waslander2009.onboard import Onboard
from uasfly.reproduce.waslander2009.sensors import AS_LARGEST, AS_SIGMA, SensorErrors
from uasfly.sim.plant import Plant
from uasfly.wind.compensation import tilt_offsets

PAPER = "waslander2009"
# The paper's controllers in its order, and how far they stray in its hover [m].
CONTROLLERS = {"waslander_pid": 0.4, "pid_dd": 0.15, "pid_dd_wind": 0.1}
OWN = ("pid", "pid_dd", "pid_dd_wind", "nmpc")
TITLES = {
    "waslander_pid": "PID",
    "pid_dd": "PID-DD",
    "pid_dd_wind": "PID-DD + wind",
    "pid": "backup PID",
    "nmpc": "NMPC",
}
MAIN = "sensors"  # the ones that feed; the others only look
BY_ACCELEROMETER = "wind and acceleration by the paper's sensors"
BY_ALL = "motion too"
BY_OBSERVER = "all by uasfly's observer, position noise 1 cm"
WRONG_DRAG = 1.1

HOVER, STRAIGHT, CIRCLE, WIND = "hover", "straight path", "circular path", "wind from accelerometers"

Key = tuple[str, str, str]  # experiment, controller, what it is fed by
Records = Mapping[Key, Record]


@dataclass(frozen=True, slots=True)
class Extent:
    """How much is flown: the hover's time, the line's length, the circle's turns."""

    hover_s: float = 30.0
    straight_m: float = 8.0
    turns: float = 2.0


def reproduce(seed: int, progress: Progress) -> Reproduction:
    """Fly all experiments and compare with the paper."""
    extent = Extent()
    plans = flight_plans(seed, extent)
    records: dict[Key, Record] = {}
    for number, (key, plan) in enumerate(plans.items()):
        experiment, name, fed_by = key
        progress(f"{experiment}, {TITLES[name]}, {fed_by}", number / len(plans))
        records[key] = fly(plan)
    progress("all flown", 1.0)
    return compare(records, extent)


def flight_plans(seed: int, extent: Extent) -> dict[Key, PaperFlight]:
    """Everything that is flown."""
    airframe, plant = vehicle.load_vehicle()
    missions = {
        HOVER: vehicle.hover(extent.hover_s),
        STRAIGHT: vehicle.straight(extent.straight_m),
        CIRCLE: vehicle.circle(extent.turns),
    }
    plans: dict[Key, PaperFlight] = {}
    for experiment, mission in missions.items():
        own = OWN if experiment == HOVER else ("nmpc",)
        plan = PaperFlight(airframe, plant, vehicle.paper_scenario(), mission, "", seed, {}, flies_by=None)
        for name in CONTROLLERS:
            looks_on = experiment != STRAIGHT and name == "pid_dd_wind"
            fed = replace(plan, controller=name, onboard=_sensors(airframe, plant, looks_on), flies_by=MAIN)
            plans[experiment, name, BY_ACCELEROMETER] = fed
            if experiment == HOVER:
                plans[experiment, name, BY_ALL] = replace(
                    fed, onboard=_sensors(airframe, plant, looks_on=False), moves_by=True
                )
        for name in own:
            plans[experiment, name, BY_OBSERVER] = replace(plan, controller=name)
    return plans


def compare(records: Records, extent: Extent) -> Reproduction:
    """Rows and pictures of flights, one for each of `flight_plans`."""
    _, plant = vehicle.load_vehicle()
    rows = (
        *_hover_rows(records, extent),
        *_path_rows(records, STRAIGHT),
        *_path_rows(records, CIRCLE),
        *_wind_rows(records, plant),
    )
    return Reproduction(PAPER, rows, _pictures(records))


def _sensors(airframe: Airframe, plant: Plant, looks_on: bool) -> dict[str, MakeOnboard]:
    """The sensors that a flight is fed by, and with `looks_on` others that are only compared."""
    onboard: dict[str, MakeOnboard] = {MAIN: _aboard(airframe, plant, AS_LARGEST)}
    if looks_on:
        onboard["no bias"] = _aboard(airframe, plant, AS_LARGEST, treats_bias=False)
        onboard["sigma"] = _aboard(airframe, plant, AS_SIGMA)
        onboard["wrong drag"] = _aboard(airframe, plant, AS_LARGEST, scale=WRONG_DRAG)
        onboard["unknown ground"] = _aboard(airframe, plant, replace(AS_LARGEST, tilt_rad=math.radians(2.0)))
    return onboard


def _aboard(
    airframe: Airframe, plant: Plant, errors: SensorErrors, *, treats_bias: bool = True, scale: float = 1.0
) -> MakeOnboard:
    model, density = vehicle.accelerometer_model(plant, scale), vehicle.gust_density()

    def make(quaternion: Array, rng: np.random.Generator) -> Onboard:
        lag_s = plant.rotors.lag_s
        return Onboard(airframe, lag_s, model, errors, rng, quaternion, wind_density=density, treats_bias=treats_bias)

    return make


def _hover_rows(records: Records, extent: Extent) -> list[Row]:
    rows: list[Row] = []
    what = f"{extent.hover_s:.0f} s at (0, 0, 2), {BY_ACCELEROMETER}; how strong the paper's wind is, is not stated"
    for name, paper in CONTROLLERS.items():
        record = records[HOVER, name, BY_ACCELEROMETER]
        for axis, value in zip("xyz", record.largest().tolist(), strict=True):
            note = f"{what}; height has no double derivative" if (axis, name) == ("z", "pid_dd") else what
            rows.append(
                Row(HOVER, f"{TITLES[name]}: largest deviation {axis}", "m", paper, value, value <= paper, note)
            )
        rows.append(Row(HOVER, f"{TITLES[name]}: RMS", "m", None, record.rms(), None, what))
        rows.append(Row(HOVER, f"{TITLES[name]}: RMS, horizontal", "m", None, record.rms(slice(0, 2)), None, what))
    rows += _order_rows(records, HOVER)
    for name, paper in CONTROLLERS.items():
        record, title = records[HOVER, name, BY_ALL], f"{TITLES[name]}, {BY_ALL}"
        value, note = float(record.largest().max()), "5 cm of white GPS noise at 10 Hz outweigh the wind"
        rows.append(Row(HOVER, f"{title}: largest deviation of an axis", "m", paper, value, value <= paper, note))
        rows.append(Row(HOVER, f"{title}: RMS", "m", None, record.rms(), None, note))
    for name in OWN:
        rows += _stray(HOVER, f"uasfly's {TITLES[name]}", records[HOVER, name, BY_OBSERVER], BY_OBSERVER)
    return rows


def _path_rows(records: Records, experiment: str) -> list[Row]:
    rows: list[Row] = []
    for name in CONTROLLERS:
        rows += _stray(experiment, TITLES[name], records[experiment, name, BY_ACCELEROMETER], BY_ACCELEROMETER)
    rows += _order_rows(records, experiment)
    return rows + _stray(experiment, "uasfly's NMPC", records[experiment, "nmpc", BY_OBSERVER], BY_OBSERVER)


def _order_rows(records: Records, experiment: str) -> list[Row]:
    """Whether each of the paper's controllers strays less than the one before, by RMS."""
    rows = []
    for before, after in pairwise(CONTROLLERS):
        ratio = records[experiment, after, BY_ACCELEROMETER].rms() / records[experiment, before, BY_ACCELEROMETER].rms()
        note = f"paper: below 1; {'so here' if ratio < 1.0 else 'NOT so here'}"
        rows.append(Row(experiment, f"RMS, {TITLES[after]} / {TITLES[before]}", "", None, ratio, None, note))
    return rows


def _stray(experiment: str, title: str, record: Record, note: str) -> list[Row]:
    worst = float(record.largest().max())
    return [
        Row(experiment, f"{title}: largest deviation of an axis", "m", None, worst, None, note),
        Row(experiment, f"{title}: RMS", "m", None, record.rms(), None, note),
    ]


def _wind_rows(records: Records, plant: Plant) -> list[Row]:
    hover, circle = (records[one, "pid_dd_wind", BY_ACCELEROMETER] for one in (HOVER, CIRCLE))
    failure = "the paper's failure: 0.1 m/s^2 of bias on each axis is untreated"
    known, rough = "ground level to 0.3 deg", "ground level to 2 deg"
    rows: list[Row] = []
    for record, sensors, kind, title, note in (
        (hover, MAIN, "inverted", "inversion, bias untreated", failure),
        (hover, MAIN, "inverted_after_ground", "inversion, less what it showed on the ground", known),
        (hover, "no bias", "filtered", "filter, bias untreated", failure),
        (hover, MAIN, "filtered", "filter with bias", f"wanted: 0.5 m/s; 0.3 g read as 3 sigma; {known}"),
        (hover, "sigma", "filtered", "filter with bias, 0.3 g as sigma", "the paper's other reading"),
        (hover, "wrong drag", "filtered", "filter with bias, drag 10 % too large", "the wind is seen as too small"),
        (hover, "unknown ground", "filtered", f"filter with bias, {rough}", "one heading: bias hides behind tilt"),
        (circle, "unknown ground", "filtered", f"circles, filter with bias, {rough}", "turning tells them apart"),
        (circle, MAIN, "filtered", "circles, filter with bias", known),
    ):
        rows += _wind_row(record, sensors, kind, title, note)
    for name, record in ((HOVER, hover), (CIRCLE, circle)):
        for sensors, ground in ((MAIN, known), ("unknown ground", rough)):
            error = record.estimates[sensors]["bias"][-1] - record.true_bias[sensors]
            level = float(np.linalg.norm(error[:2]))
            what = f"bias error at the end, {name}, {ground}"
            rows.append(Row(WIND, what, "m/s^2", None, level, None, "horizontal; the bias itself has 0.14"))
    rows += _tilt_rows(hover, plant)
    return rows


def _wind_row(record: Record, sensors: str, kind: str, title: str, note: str) -> list[Row]:
    error = record.estimates[sensors][kind] - record.wind
    level = float(np.sqrt((error[:, :2] ** 2).sum(axis=1).mean()))
    upright = float(np.sqrt((error[:, 2] ** 2).mean()))
    return [
        Row(WIND, f"{title}: RMSE, horizontal", "m/s", None, level, None, note),
        Row(WIND, f"{title}: RMSE, vertical", "m/s", None, upright, None, note),
    ]


def _tilt_rows(hover: Record, plant: Plant) -> list[Row]:
    """Eq. 31, 32 at the true mean wind against how the vehicle really leant."""
    model = vehicle.accelerometer_model(plant)
    leant = np.mean([euler_from_quaternion(quaternion)[:2] for quaternion in hover.quaternion], axis=0)
    wanted = []
    for quaternion, wind in zip(hover.quaternion, hover.wind, strict=True):
        rotation = rotation_matrix(quaternion)
        drag = rotation @ model.drag(rotation.T @ wind)
        yaw = euler_from_quaternion(quaternion)[2]
        wanted.append(tilt_offsets(drag, yaw, math.hypot(GRAVITY_M_S2 - drag[2], math.hypot(drag[0], drag[1]))))
    off = np.degrees(np.abs(np.mean(wanted, axis=0) - leant))
    note = f"mean of the hover; it leant {np.degrees(leant[0]):.2f} deg in roll, {np.degrees(leant[1]):.2f} in pitch"
    return [
        Row(HOVER, f"tilt by (31), (32) at the true wind against the flown one, {axis}", "deg", None, value, None, note)
        for axis, value in zip(("roll", "pitch"), off.tolist(), strict=True)
    ]


def _pictures(records: Records) -> dict[str, Callable[[Path], None]]:
    def by_accelerometer(experiment: str) -> dict[str, Record]:
        return {TITLES[name]: records[experiment, name, BY_ACCELEROMETER] for name in CONTROLLERS}

    hovers = {**by_accelerometer(HOVER), "uasfly's NMPC": records[HOVER, "nmpc", BY_OBSERVER]}
    return {
        "hover": partial(pictures.positions, hovers),
        "wind": partial(pictures.winds, records[HOVER, "pid_dd_wind", BY_ACCELEROMETER], MAIN),
        "straight": partial(pictures.paths, by_accelerometer(STRAIGHT)),
        "circle": partial(pictures.paths, by_accelerometer(CIRCLE)),
    }
