"""The paper's figures beside uasfly's."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from uasfly.messages import Array
from uasfly.reproduce.kalaitzakis2023 import experiments as e
from uasfly.reproduce.kalaitzakis2023.flight import Record
from uasfly.reproduce.rows import Row, mean_row
from uasfly.sim.scenario import Scenario
from uasfly.sim.wind.settings import JetSchedule

Records = Mapping[str, Sequence[Record]]  # by experiment, a record a seed

MARKER_ESTIMATE_M, GNSS_M = 0.13, 1.28
TRACKING_CM = {
    e.BLOWER: 13.2,
    e.HEAD: 7.6,
    e.SIDE: 7.4,
    e.SPIRAL_CALM: 10.4,
    e.SPIRAL_SIDE: 11.4,
    e.SPIRAL_UP: 10.2,
    e.SPIRAL_DOWN: 9.2,
}
FIELD_CM = (12.0, 23.0, 16.0)
FORCES_M_S2: Mapping[tuple[int, int], float] = {(0, 0): 1.5, (1, 1): -0.8}  # of blower and axis
FORCE_TOLERANCE = 0.15
STEP_MS, STEP_PI_MS = 15.0, 30.0
SETTLED_S = 3.0  # after a blower has come up: what the estimate has settled to

_BY_NOISE_MODEL = "markers by the noise model, not rendered"
_TWO_CASES = "what GNSS was at the first sight is not stated: both cases are flown"
_SPIRAL_GUST = "the paper does not state the gust's speed: 13.4 m/s at (-1, 0), as in the side gust"
_AS_SEEN = "as seen from the marker"
_IN_WORLD = "in the world"


def all_rows(records: Records, blowers: Scenario) -> tuple[Row, ...]:
    """Every row, in the order of the paper's experiments.

    Args:
        records: of all of `experiments.EXPERIMENTS`.
        blowers: the scenario of the hover before a blower, for when each blows.
    """
    return (
        *_marker_rows(records[e.MARKERS], records[e.MARKERS_SOUND]),
        *_tracking_rows(records, e.BLOWER, "1 cm position noise for the paper's motion capture"),
        *force_rows(records[e.BLOWER], [jet.schedule for jet in blowers.wind.jets]),
        *_tracking_rows(records, e.HEAD, "17.5 m^2/s / (distance + 0.18 m) meets both of the paper's speeds"),
        *_tracking_rows(records, e.SIDE, "13.4 m/s on the axis, half of it 0.25 m beside it (assumed)"),
        *_tracking_rows(records, e.SPIRAL_CALM, ""),
        *_tracking_rows(records, e.SPIRAL_SIDE, _SPIRAL_GUST),
        *_tracking_rows(records, e.SPIRAL_UP, _SPIRAL_GUST),
        *_tracking_rows(records, e.SPIRAL_DOWN, _SPIRAL_GUST),
        *_field_rows(records[e.FIELD]),
        *_step_rows(records),
    )


def _marker_rows(walking: Sequence[Record], sound: Sequence[Record]) -> list[Row]:
    title = e.EXPERIMENTS[e.MARKERS].title
    gnss, by_marker = _totals(walking, "gnss_rms_m"), _totals(walking, "by_marker", "estimate_rms_m")
    later = "GNSS walks from 5 s in offboard on"
    offset = _mean_offset_m(walking)
    paper_ratio = MARKER_ESTIMATE_M / GNSS_M
    return [
        mean_row(title, "GNSS error, RMS", "m", None, gnss, f"paper: {GNSS_M} m, a condition; eq. 11, walking at once"),
        mean_row(
            title,
            f"position estimate, RMS {_AS_SEEN}",
            "m",
            MARKER_ESTIMATE_M,
            by_marker,
            f"{_BY_NOISE_MODEL}; {_TWO_CASES}",
        ),
        mean_row(
            title,
            f"position estimate, RMS {_AS_SEEN}, over GNSS error",
            "",
            paper_ratio,
            by_marker / gnss,
            "the GNSS error differs from flight to flight; the paper's ratio is 0.13 / 1.28",
        ),
        mean_row(
            title,
            f"position estimate, RMS {_IN_WORLD}, GNSS wrong before the first sight",
            "m",
            MARKER_ESTIMATE_M,
            _totals(walking, "estimate_rms_m"),
            f"a marker is placed by the GNSS of its first sight, here {offset:.2f} m off; no later sighting can tell",
        ),
        mean_row(
            title,
            f"position estimate, RMS {_IN_WORLD}, GNSS sound until the first sight",
            "m",
            MARKER_ESTIMATE_M,
            _totals(sound, "estimate_rms_m"),
            f"{later}: {_totals(sound, 'gnss_rms_m').mean():.2f} m RMS; what went wrong later is made up for",
        ),
        mean_row(
            title,
            f"position, RMS {_AS_SEEN}",
            "m",
            None,
            _totals(walking, "by_marker", "tracking_rms_m"),
            "true minus wanted; light wind, 2 m/s at 10 m",
        ),
    ]


def _tracking_rows(records: Records, name: str, note: str) -> list[Row]:
    title, flights = e.EXPERIMENTS[name].title, records[name]
    rms, largest = 100.0 * _totals(flights, "tracking_rms_m"), 100.0 * _numbers(flights, "tracking_max_m")
    return [
        mean_row(title, "position, RMS", "cm", TRACKING_CM[name], rms, note),
        mean_row(title, "position, largest error", "cm", None, largest, ""),
    ]


def force_rows(flights: Sequence[Record], schedules: Sequence[JetSchedule]) -> list[Row]:
    """The force of each blower on each axis: mean of the estimate while it blows, and how far that is from the truth.

    Args:
        flights: of the hover before a blower.
        schedules: when each blower blows.
    """
    title = e.EXPERIMENTS[e.BLOWER].title
    rows = []
    for number, schedule in enumerate(schedules):
        assert schedule.end_s is not None
        begin_s, end_s = schedule.start_s + schedule.edge_s + SETTLED_S, schedule.end_s
        blown = [(flight, flight.during(begin_s, end_s)) for flight in flights]
        estimated = np.array([flight.force_estimated[rows].mean(axis=0) for flight, rows in blown])
        true = np.mean([flight.force_true[rows].mean(axis=0) for flight, rows in blown], axis=0)
        for axis, letter in enumerate("xyz"):
            paper = FORCES_M_S2.get((number, axis))
            wanted = "" if paper is None else f"; wanted: the paper's within {FORCE_TOLERANCE:.0%}"
            note = f"mean from {begin_s:g} to {end_s:g} s; truly {true[axis]:.2f}{wanted}"
            quantity = f"force of blower {number + 1}, {letter}"
            rows.append(mean_row(title, quantity, "m/s^2", paper, estimated[:, axis], note, accepts=force_agrees))
    errors = [_rms(flight.force_estimated - flight.force_true) for flight in flights]
    rows.append(mean_row(title, "force, estimated minus true, RMS", "m/s^2", None, errors, "all of the hover"))
    return rows


def force_agrees(ours: float, theirs: float) -> bool:
    """Whether a force has the sign and, within `FORCE_TOLERANCE`, the size of the paper's."""
    return abs(ours - theirs) <= FORCE_TOLERANCE * abs(theirs)


def _field_rows(flights: Sequence[Record]) -> list[Row]:
    title = e.EXPERIMENTS[e.FIELD].title
    wind = f"the paper's wind is not stated: {e.FIELD_WIND_M_S:g} m/s at 10 m from the side, Dryden gusts"
    gnss = _totals(flights, "gnss_rms_m")
    drift = [float(np.linalg.norm(flight.gnss - flight.truth, axis=1).max()) for flight in flights]
    rows = [
        mean_row(title, "GNSS error, RMS", "m", None, gnss, f"sound until the first sight; {_BY_NOISE_MODEL}"),
        mean_row(title, "GNSS error, largest", "m", None, drift, "paper: over 1 m, a condition"),
    ]
    note = f"x to the board, y along the wind, z up; {wind}"
    for where, path in ((_AS_SEEN, ("by_marker", "tracking_rms_m")), (_IN_WORLD, ("tracking_rms_m",))):
        for letter, paper in zip("xyz", FIELD_CM, strict=True):
            values = 100.0 * _numbers(flights, *path, letter)
            rows.append(mean_row(title, f"position {letter}, RMS {where}", "cm", paper, values, note))
    return rows


def _step_rows(records: Records) -> list[Row]:
    title = e.EXPERIMENTS[e.PAPER_GRID].title
    flown = [flight for name in TRACKING_CM for flight in records[name]]
    shipped, paper_grid = _means(flown), _means(records[e.PAPER_GRID])
    grid = f"{e.PAPER_NODES} x {e.PAPER_INTERVAL_S:g} s"
    here = "one real-time iteration, on this computer and not on the paper's NUC i5; no two runs give the same"
    p99 = [float(np.percentile(flight.solve_ms, 99)) for flight in records[e.PAPER_GRID]]
    return [
        mean_row(title, "mean, 3 s in 25 nodes as shipped", "ms", STEP_MS, shipped, here),
        mean_row(title, f"mean, {grid} as in the paper", "ms", STEP_MS, paper_grid, here),
        mean_row(
            title,
            f"99th percentile, {grid}",
            "ms",
            None,
            p99,
            f"paper: a mean of {STEP_PI_MS:g} ms on a Raspberry Pi 4, which cannot be compared here; "
            "uasfly bench measures on any computer",
        ),
    ]


def _means(flights: Iterable[Record]) -> list[float]:
    return [float(flight.solve_ms.mean()) for flight in flights]


def _rms(errors: Array) -> float:
    return math.sqrt(float((errors**2).sum(axis=1).mean()))


def _mean_offset_m(flights: Sequence[Record]) -> float:
    """How far the filter's world, which hangs on the marker, lies from the true one: mean of the flights [m]."""
    return float(np.mean([np.linalg.norm((flight.placed - flight.truth).mean(axis=0)) for flight in flights]))


def _totals(flights: Sequence[Record], *path: str) -> Array:
    return _numbers(flights, *path, "total")


def _numbers(flights: Sequence[Record], *path: str) -> Array:
    """A number out of each summary."""
    found = []
    for flight in flights:
        value = flight.summary
        for key in path:
            value = value[key]
        found.append(value)
    return np.array(found, dtype=np.float64)
