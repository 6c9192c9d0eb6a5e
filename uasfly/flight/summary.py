"""The closing summary of a flight: what was flown, how well it was tracked and what went wrong."""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from uasfly.errors import FileError
from uasfly.flight.tracking_errors import MarkerDatum, TrackingErrors
from uasfly.flight.wind_summary import WindSummary
from uasfly.messages import Array, MarkerSample, OdometrySample, Phase, Sample, Status, TruthSample
from uasfly.preflight_messages import PreflightCheck

_COMPARED = (TruthSample, OdometrySample)


def _figures() -> array[float]:
    """Figures of every cycle: eight bytes each, so that an hour of flight is some megabytes."""
    return array("d")


@dataclass(slots=True)
class SummaryCollector:
    """Collects a flight's figures cycle by cycle; the driver adds what only a clock can know.

    Errors are counted while the legs fly: truth minus reference where there is truth, else estimate minus reference.
    Truth arrives later than it was true, so each truth sample is compared with the cycles around its own time.
    """

    duration_s: float = 0.0
    _first_s: float | None = None
    _errors: TrackingErrors = field(default_factory=TrackingErrors)
    _wind: WindSummary = field(default_factory=WindSummary)
    _force_sum: Array = field(default_factory=lambda: np.zeros(3))
    _force_count: int = 0
    _solve_ms: array[float] = field(default_factory=_figures)
    _cycle_ms: array[float] = field(default_factory=_figures)
    _latency_ms: array[float] = field(default_factory=_figures)
    _setpoint_times_s: array[float] = field(default_factory=_figures)
    _sighted_s: array[float] = field(default_factory=_figures)
    _sighting_latency_ms: array[float] = field(default_factory=_figures)
    _fallbacks: dict[str, int] = field(default_factory=dict)
    _warnings: list[str] = field(default_factory=list)
    _preflight: list[dict[str, str]] = field(default_factory=list)
    _thrust_trim: float = 0.0
    _phase: Phase = Phase.CONNECT
    _reason: str = ""

    def cycle(self, status: Status, samples: tuple[Sample, ...], datum: MarkerDatum | None = None) -> None:
        """Take in one step's samples and status; `datum` where a simulated flight has a marker in its filter."""
        if self._first_s is None:
            self._first_s = status.time_s
        self.duration_s = status.time_s - self._first_s
        self._phase, self._reason = status.phase, status.reason or self._reason
        for severity, text in status.announcements:
            if severity <= 4 and text not in self._warnings:
                self._warnings.append(text)
        if status.fallback:
            self._fallbacks[status.fallback] = self._fallbacks.get(status.fallback, 0) + 1
        flying = status.phase is Phase.LEGS and status.estimate is not None
        if flying and status.reference_position_in_world is not None and status.leg_started:
            estimate = status.estimate
            assert estimate is not None
            reference = status.reference_position_in_world
            self._errors.cycle(status.time_s, estimate.position_in_world, reference, datum)
            self._force_sum += estimate.force_in_world
            self._force_count += 1
            self._thrust_trim = status.thrust_trim
        for sample in samples:
            if isinstance(sample, _COMPARED):
                self._errors.hear(sample)
                if isinstance(sample, TruthSample):
                    self._wind.hear(sample)
            elif isinstance(sample, MarkerSample):
                self._sighted_s.append(sample.time_s)
                self._sighting_latency_ms.append((status.time_s - sample.time_s) * 1e3)
        if flying and status.leg_started:
            self._wind.cycle(status)

    def abort(self, status: Status) -> None:
        """The flight was broken off outside of the step; `status` tells why, and nothing is computed from it."""
        self._phase, self._reason = status.phase, status.reason

    def setpoint_sent(self, time_s: float, motion_s: float = math.nan) -> None:
        """A setpoint has left at `time_s`; `motion_s` is when the newest motion that it answers to was true."""
        self._setpoint_times_s.append(time_s)
        if math.isfinite(motion_s):
            self._latency_ms.append((time_s - motion_s) * 1e3)

    def preflight(self, checks: tuple[PreflightCheck, ...]) -> None:
        """The preflight check was made; of several the last counts."""
        if checks:
            self._preflight = [{**asdict(check), "verdict": check.verdict.value} for check in checks]

    def timed(self, solve_ms: float | None, cycle_ms: float) -> None:
        """Times of one cycle by the driver's clock; `solve_ms` is None where nothing was solved."""
        if solve_ms is not None:
            self._solve_ms.append(solve_ms)
        self._cycle_ms.append(cycle_ms)

    def warn(self, text: str) -> None:
        """Add a warning that did not come from the step."""
        if text not in self._warnings:
            self._warnings.append(text)

    def result(self, *, wall_s: float, rejected: dict[str, int], **identity: object) -> dict[str, Any]:
        """The summary as plain data; `identity` (airframe, mission, scenario, seed, ...) is copied into it."""
        errors = self._errors
        errors.compare()
        tracking = errors.against_truth if errors.against_truth.count else errors.against_estimate
        times = np.array(self._setpoint_times_s)
        gaps = np.diff(times)
        span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
        force = self._force_sum / max(1, self._force_count)
        return {
            "outcome": "completed" if self._phase is Phase.DONE else "aborted",
            "reason": self._reason if self._phase is not Phase.DONE else "",
            **identity,
            "duration_s": round(self.duration_s, 3),
            "tracking_rms_m": _rounded(tracking.rms()),
            "tracking_max_m": round(tracking.largest, 5) if tracking.count else None,
            "tracking_against": "truth" if errors.against_truth.count else "estimate",
            "estimate_rms_m": _rounded(errors.estimate.rms()),
            "gnss_rms_m": _rounded(errors.gnss.rms()),
            "by_marker": self._by_marker(),
            "solve_ms": _quantiles(self._solve_ms),
            "cycle_ms": _quantiles(self._cycle_ms),
            "latency_ms": _quantiles(self._latency_ms),
            "setpoint_rate_hz": round(len(gaps) / span, 3) if span > 0.0 else 0.0,
            "setpoint_gap_max_s": round(float(gaps.max()), 4) if len(gaps) else None,
            "fallback_steps": sum(self._fallbacks.values()),
            "fallbacks": dict(self._fallbacks),
            "rejected": dict(rejected),
            "sightings": self._sightings(),
            "force_m_s2": [round(value, 4) for value in force.tolist()],
            "thrust_trim": round(self._thrust_trim, 4),
            "wind": self._wind.result(),
            "real_time_factor": round(self.duration_s / wall_s, 3) if wall_s > 0.0 else None,
            "warnings": list(self._warnings),
            "preflight": list(self._preflight),
        }

    def _by_marker(self) -> dict[str, Any] | None:
        """Errors as seen from the marker, whose place in the world is known no better than GNSS was at first sight."""
        if not self._errors.by_marker.count:
            return None
        return {
            "tracking_rms_m": _rounded(self._errors.by_marker.rms()),
            "tracking_max_m": round(self._errors.by_marker.largest, 5),
            "estimate_rms_m": _rounded(self._errors.estimate_by_marker.rms()),
            "estimate_max_m": round(self._errors.estimate_by_marker.largest, 5),
        }

    def _sightings(self) -> dict[str, Any] | None:
        """How often bundles were seen, and how old a sighting was when it could be used; None where none was."""
        times = np.unique(np.array(self._sighted_s))
        if not len(times):
            return None
        span = float(times[-1] - times[0])
        return {
            "count": len(self._sighted_s),
            "rate_hz": round((len(times) - 1) / span, 3) if span > 0.0 else 0.0,
            "gap_max_s": round(float(np.diff(times).max()), 3) if len(times) > 1 else None,
            "latency_ms": _quantiles(self._sighting_latency_ms),
        }


def _rounded(values: dict[str, float] | None) -> dict[str, float] | None:
    return None if values is None else {key: round(value, 5) for key, value in values.items()}


def _quantiles(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    median, p99 = np.percentile(values, (50, 99)).tolist()
    return {"median": round(median, 4), "p99": round(p99, 4), "max": round(max(values), 4)}


def write_summary(summary: dict[str, Any], path: Path) -> None:
    """Write the summary as JSON.

    Raises:
        FileError: when the file cannot be written.
    """
    try:
        path.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise FileError(str(path), [f"the summary cannot be written: {error.strerror or error}"]) from error
