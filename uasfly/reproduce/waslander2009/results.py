"""The paper's figures beside uasfly's: means of several seeds."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from uasfly.airframe import GRAVITY_M_S2
from uasfly.frames import euler_from_quaternion, rotation_matrix
from uasfly.messages import Array
from uasfly.reproduce.rows import Row, holds_in, mean_row
from uasfly.reproduce.waslander2009 import experiments as e
from uasfly.reproduce.waslander2009 import vehicle
from uasfly.reproduce.waslander2009.flight import Record
from uasfly.sim.plant import Plant
from uasfly.wind.compensation import tilt_offsets

WIND = "wind from accelerometers"
WANTED_M_S = 0.5
_HORIZONTAL = slice(0, 2)
_NOT_STATED = "how strong the paper's wind is, is not stated"
_LIKE_BEFORE = "height has no double derivative: as without it"


def all_rows(records: e.Records, extent: e.Extent) -> tuple[Row, ...]:
    """Every row, of flights of all of `experiments.flight_plans`."""
    _, plant = vehicle.load_vehicle()
    return (
        *_hover_rows(records, e.HOVER, extent),
        *_other_hover_rows(records),
        *_hover_rows(records, e.STRONG, extent),
        *_stray(e.STRONG, "uasfly's NMPC", records[e.STRONG, "nmpc", e.BY_OBSERVER], e.BY_OBSERVER),
        *_path_rows(records, e.STRAIGHT),
        *_path_rows(records, e.CIRCLE),
        *_wind_rows(records),
        *_tilt_rows(records[e.HOVER, "pid_dd_wind", e.BY_ACCELEROMETER], plant),
    )


def _hover_rows(records: e.Records, experiment: str, extent: e.Extent) -> list[Row]:
    rows: list[Row] = []
    knots = {e.HOVER: vehicle.LIGHT_M_S, e.STRONG: vehicle.STRONG_M_S}[experiment] / vehicle.KNOT_M_S
    what = f"{extent.hover_s:.0f} s at (0, 0, 2), {e.BY_ACCELEROMETER}; {knots:.0f} knots at 20 ft: {_NOT_STATED}"
    for name, paper in e.CONTROLLERS.items():
        flights, title = records[experiment, name, e.BY_ACCELEROMETER], e.TITLES[name]
        largest = np.array([flight.largest() for flight in flights])
        for number, axis in enumerate("xyz"):
            note = f"{what}; {_LIKE_BEFORE}" if (axis, name) == ("z", "pid_dd") else what
            rows.append(
                mean_row(experiment, f"{title}: largest deviation {axis}", "m", paper, largest[:, number], note)
            )
        worst = largest.max(axis=1)
        within = f"within the paper's {paper:g} m {holds_in(worst, partial(operator.ge, paper))}"
        rows.append(mean_row(experiment, f"{title}: largest deviation of an axis", "m", paper, worst, within))
        rows.append(mean_row(experiment, f"{title}: RMS", "m", None, _rms(flights), what))
        rows.append(mean_row(experiment, f"{title}: RMS, horizontal", "m", None, _rms(flights, _HORIZONTAL), what))
    return rows + _order_rows(records, experiment)


def _other_hover_rows(records: e.Records) -> list[Row]:
    rows: list[Row] = []
    for name, paper in e.CONTROLLERS.items():
        flights, title = records[e.HOVER, name, e.BY_ALL], f"{e.TITLES[name]}, {e.BY_ALL}"
        note = "5 cm of white GPS noise at 10 Hz outweigh the wind"
        rows.append(mean_row(e.HOVER, f"{title}: largest deviation of an axis", "m", paper, _worst(flights), note))
        rows.append(mean_row(e.HOVER, f"{title}: RMS", "m", None, _rms(flights), note))
    for name in e.OWN:
        rows += _stray(e.HOVER, f"uasfly's {e.TITLES[name]}", records[e.HOVER, name, e.BY_OBSERVER], e.BY_OBSERVER)
    return rows


def _path_rows(records: e.Records, experiment: str) -> list[Row]:
    rows: list[Row] = []
    for name in e.CONTROLLERS:
        rows += _stray(experiment, e.TITLES[name], records[experiment, name, e.BY_ACCELEROMETER], e.BY_ACCELEROMETER)
    rows += _order_rows(records, experiment)
    return rows + _stray(experiment, "uasfly's NMPC", records[experiment, "nmpc", e.BY_OBSERVER], e.BY_OBSERVER)


def _order_rows(records: e.Records, experiment: str) -> list[Row]:
    """Whether each of the paper's controllers strays less than the one before: flight by flight, three ways."""
    measures: dict[str, Callable[[Sequence[Record]], Array]] = {
        "RMS": _rms,
        "RMS, horizontal": lambda flights: _rms(flights, _HORIZONTAL),
        "largest deviation of an axis": _worst,
    }
    rows = []
    for before, after in pairwise(e.CONTROLLERS):
        for title, measure in measures.items():
            first, second = (measure(records[experiment, name, e.BY_ACCELEROMETER]) for name in (before, after))
            ratios = second / first
            so = "so here" if ratios.mean() < 1.0 else "NOT so here"
            note = f"paper: below 1; {so} in the mean, {holds_in(ratios, lambda ratio: ratio < 1.0)}"
            quantity = f"{title}: {e.TITLES[after]} / {e.TITLES[before]}"
            rows.append(mean_row(experiment, quantity, "", None, ratios, note))
    return rows


def _stray(experiment: str, title: str, flights: Sequence[Record], note: str) -> list[Row]:
    return [
        mean_row(experiment, f"{title}: largest deviation of an axis", "m", None, _worst(flights), note),
        mean_row(experiment, f"{title}: RMS", "m", None, _rms(flights), note),
    ]


def _worst(flights: Sequence[Record]) -> Array:
    return np.array([flight.largest().max() for flight in flights])


def _rms(flights: Sequence[Record], axes: slice = slice(0, 3)) -> Array:
    return np.array([flight.rms(axes) for flight in flights])


def _wind_rows(records: e.Records) -> list[Row]:
    hover, strong, circle = (records[one, "pid_dd_wind", e.BY_ACCELEROMETER] for one in (e.HOVER, e.STRONG, e.CIRCLE))
    failure = "the paper's failure: 0.1 m/s^2 of bias on each axis is untreated"
    known, rough = "ground level to 0.3 deg", "ground level to 2 deg"
    drawn = f"0.3 g read as 3 sigma; {known} (sigma, drawn): 1 deg of it is 0.5 m/s of wind"
    rows: list[Row] = []
    for flights, sensors, kind, title, note in (
        (hover, e.MAIN, "inverted", "inversion, bias untreated", failure),
        (hover, e.MAIN, "inverted_after_ground", "inversion, less what it showed on the ground", known),
        (hover, "no bias", "filtered", "filter, bias untreated", failure),
        (hover, e.MAIN, "filtered", "filter with bias", drawn),
        (hover, "sigma", "filtered", "filter with bias, 0.3 g as sigma", "the paper's other reading"),
        (hover, "wrong drag", "filtered", "filter with bias, drag 10 % too large", "the wind is seen as too small"),
        (hover, "unknown ground", "filtered", f"filter with bias, {rough}", "one heading: bias hides behind tilt"),
        (strong, e.MAIN, "inverted", "stronger wind, inversion, bias untreated", failure),
        (strong, e.MAIN, "filtered", "stronger wind, filter with bias", known),
        (circle, "unknown ground", "filtered", f"circles, filter with bias, {rough}", "turning tells them apart"),
        (circle, e.MAIN, "filtered", "circles, filter with bias", known),
    ):
        rows += _wind_row(flights, sensors, kind, title, note)
    for name, flights in ((e.HOVER, hover), (e.CIRCLE, circle)):
        for sensors, ground in ((e.MAIN, known), ("unknown ground", rough)):
            errors = [flight.estimates[sensors]["bias"][-1] - flight.true_bias[sensors] for flight in flights]
            level = [float(np.linalg.norm(error[_HORIZONTAL])) for error in errors]
            what = f"bias error at the end, {name}, {ground}"
            rows.append(mean_row(WIND, what, "m/s^2", None, level, "horizontal; the bias itself has 0.14"))
    return rows


def _wind_row(flights: Sequence[Record], sensors: str, kind: str, title: str, note: str) -> list[Row]:
    errors = [flight.estimates[sensors][kind] - flight.wind for flight in flights]
    level = [float(np.sqrt((error[:, _HORIZONTAL] ** 2).sum(axis=1).mean())) for error in errors]
    upright = [float(np.sqrt((error[:, 2] ** 2).mean())) for error in errors]
    wanted = f"wanted: {WANTED_M_S:g} m/s, so {holds_in(level, partial(operator.ge, WANTED_M_S))}; {note}"
    return [
        mean_row(WIND, f"{title}: RMSE, horizontal", "m/s", None, level, wanted),
        mean_row(WIND, f"{title}: RMSE, vertical", "m/s", None, upright, note),
    ]


def _tilt_rows(flights: Sequence[Record], plant: Plant) -> list[Row]:
    """Eq. 31, 32 at the true mean wind against how the vehicle really leant."""
    both = [_leant_and_wanted(flight, plant) for flight in flights]
    off = np.degrees([np.abs(wanted - leant) for leant, wanted in both])
    roll, pitch = np.degrees(np.mean([leant for leant, _ in both], axis=0)).tolist()
    note = f"mean of the hover; it leant {roll:.2f} deg in roll, {pitch:.2f} in pitch"
    title = "tilt by (31), (32) at the true wind against the flown one"
    return [
        mean_row(e.HOVER, f"{title}, {axis}", "deg", None, off[:, number], note)
        for number, axis in enumerate(("roll", "pitch"))
    ]


def _leant_and_wanted(flight: Record, plant: Plant) -> tuple[Array, Array]:
    """Roll and pitch (2,) [rad], mean of a flight: as flown, and by eq. 31, 32."""
    model = vehicle.accelerometer_model(plant)
    leant = np.mean([euler_from_quaternion(quaternion)[:2] for quaternion in flight.quaternion], axis=0)
    wanted = []
    for quaternion, wind in zip(flight.quaternion, flight.wind, strict=True):
        rotation = rotation_matrix(quaternion)
        drag = rotation @ model.drag(rotation.T @ wind)
        yaw = euler_from_quaternion(quaternion)[2]
        wanted.append(tilt_offsets(drag, yaw, math.hypot(GRAVITY_M_S2 - drag[2], math.hypot(drag[0], drag[1]))))
    return np.asarray(leant), np.mean(wanted, axis=0)
