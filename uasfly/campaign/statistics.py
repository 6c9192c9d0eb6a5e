"""What the flights of a group have in common, with intervals that say how well it is known."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from uasfly.campaign.table import Row

CONFIDENCE = 0.95
RESAMPLES = 2000
BOOTSTRAP_SEED = 20230508
MOST_AT_ONCE = 4_000_000  # numbers of the bootstrap that are in memory at the same time
IDENTITY = ("airframe", "mission", "scenario", "controller")

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Group:
    """Flights that differ in their seeds (and what is scattered with them) only.

    Attributes:
        what: airframe, mission, scenario, controller and the swept fields.
        flights, successes, completed, errors: how many.
        success_rate_interval: Wilson's.
        rms_median_m, rms_mean_m: of the tracking RMS of the completed flights; None where there are none.
        rms_median_interval_m: bootstrapped. rms_mean_interval_m: Student's. None with fewer than two.
        rms_worst_m: the largest.
    """

    what: dict[str, Any]
    flights: int
    successes: int
    completed: int
    errors: int
    success_rate: float
    success_rate_interval: Interval
    rms_median_m: float | None
    rms_median_interval_m: Interval | None
    rms_mean_m: float | None
    rms_mean_interval_m: Interval | None
    rms_worst_m: float | None

    def as_dict(self) -> dict[str, Any]:
        """For scripts."""
        return asdict(self)


def grouped(rows: Sequence[Row], swept: Sequence[str]) -> list[tuple[dict[str, Any], list[Row]]]:
    """Rows by group, in the order in which groups first appear."""
    groups: dict[str, tuple[dict[str, Any], list[Row]]] = {}
    for row in rows:
        what = {name: row[name] for name in (*IDENTITY, *swept)}
        groups.setdefault(json.dumps(list(what.values())), (what, []))[1].append(row)
    return list(groups.values())


def summarise(rows: Sequence[Row], swept: Sequence[str]) -> list[Group]:
    """The figures of every group."""
    return [_group(what, members) for what, members in grouped(rows, swept)]


def label(what: dict[str, Any], among: Sequence[dict[str, Any]]) -> str:
    """A group in few words: what it does not share with all others; all of its names where there is one group only."""
    shared = {name for name in what if all(other[name] == what[name] for other in among)}
    names = [name for name in what if name not in shared] or [name for name in IDENTITY if name in what]
    ends = [name.rpartition(".")[2] for name in what]
    words = []
    for name in names:
        if name in IDENTITY:
            words.append(str(what[name]))
        else:
            end = name.rpartition(".")[2]
            words.append(f"{end if ends.count(end) == 1 else name}={json.dumps(what[name])}")
    return ", ".join(words)


def wilson(successes: int, count: int, confidence: float = CONFIDENCE) -> Interval:
    """Interval of a success rate (Wilson 1927): also right where nothing or everything succeeded."""
    from scipy.stats import norm

    z = float(norm.ppf(0.5 + confidence / 2.0))
    rate = successes / count
    scale = 1.0 + z * z / count
    middle = (rate + z * z / (2.0 * count)) / scale
    half = z / scale * math.sqrt(rate * (1.0 - rate) / count + z * z / (4.0 * count * count))
    low = 0.0 if successes == 0 else max(0.0, middle - half)
    high = 1.0 if successes == count else min(1.0, middle + half)
    return low, high


def student(values: Sequence[float], confidence: float = CONFIDENCE) -> Interval | None:
    """Interval of the mean (Student's t); None with fewer than two values."""
    from scipy.stats import t

    count = len(values)
    if count < 2:
        return None
    mean, sigma = float(np.mean(values)), float(np.std(values, ddof=1))
    half = float(t.ppf(0.5 + confidence / 2.0, count - 1)) * sigma / math.sqrt(count)
    return mean - half, mean + half


def bootstrap_median(values: Sequence[float], confidence: float = CONFIDENCE) -> Interval | None:
    """Interval of the median (percentile bootstrap, always with the same draws); None with fewer than two values."""
    count = len(values)
    if count < 2:
        return None
    data = np.asarray(values)
    generator = np.random.default_rng(BOOTSTRAP_SEED)
    medians: list[float] = []
    while len(medians) < RESAMPLES:
        rounds = min(RESAMPLES - len(medians), max(1, MOST_AT_ONCE // count))
        medians += np.median(data[generator.integers(0, count, (rounds, count))], axis=1).tolist()
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(medians, (tail, 100.0 - tail)).tolist()
    return low, high


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """The worst flights, the very worst first: errors, then aborted ones, then by their tracking RMS."""
    rank = {"error": 0, "aborted": 1}
    key = [(rank.get(row["outcome"], 2), -(row["tracking_rms_m"] or 0.0), row["index"]) for row in rows]
    return [rows[k] for k in sorted(range(len(rows)), key=key.__getitem__)[:count]]


def completed_rms(rows: Sequence[Row]) -> list[float]:
    """Tracking RMS of the flights that were completed [m]: an aborted one has flown another, shorter mission."""
    return [
        row["tracking_rms_m"] for row in rows if row["outcome"] == "completed" and row["tracking_rms_m"] is not None
    ]


def _group(what: dict[str, Any], rows: list[Row]) -> Group:
    successes = sum(row["success"] for row in rows)
    values = completed_rms(rows)
    return Group(
        what,
        flights=len(rows),
        successes=successes,
        completed=sum(row["outcome"] == "completed" for row in rows),
        errors=sum(row["outcome"] == "error" for row in rows),
        success_rate=successes / len(rows),
        success_rate_interval=wilson(successes, len(rows)),
        rms_median_m=float(np.median(values)) if values else None,
        rms_median_interval_m=bootstrap_median(values),
        rms_mean_m=float(np.mean(values)) if values else None,
        rms_mean_interval_m=student(values),
        rms_worst_m=max(values, default=None),
    )
