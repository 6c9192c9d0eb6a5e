"""The summary: figures against motions whose errors are known in closed form."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.winds import wind_estimate
from uasfly.errors import FileError
from uasfly.flight.summary import SummaryCollector, write_summary
from uasfly.messages import Array, OdometrySample, Phase, Sample, StateEstimate, Status, TruthSample

PERIOD_S = 0.02
ZERO = np.zeros(3)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
TRACKING = np.array([0.03, -0.04, 0.12])  # truth minus reference
ESTIMATE = np.array([0.01, 0.02, -0.02])  # estimate minus truth
GNSS = np.array([1.0, -2.0, 2.0])  # GNSS minus truth
FORCE = np.array([1.5, -0.5, 0.25])


def _truth_at(time_s: float) -> Array:
    """A straight line: interpolation between cycles is exact on it, using the cycle before or after is not."""
    return np.array([3.0, -2.0, 1.0]) * time_s


def _truth(time_s: float) -> TruthSample:
    return TruthSample(time_s, _truth_at(time_s), ZERO, LEVEL, ZERO, ZERO)


def _gnss(time_s: float, error: Array = GNSS) -> OdometrySample:
    return OdometrySample(time_s, _truth_at(time_s) + error, ZERO, LEVEL, ZERO)


def _status(
    time_s: float,
    phase: Phase = Phase.LEGS,
    *,
    leg_started: bool = True,
    fallback: str = "",
    reason: str = "",
    announcements: tuple[tuple[int, str], ...] = (),
) -> Status:
    position = _truth_at(time_s)
    estimate = StateEstimate(time_s, position + ESTIMATE, ZERO, LEVEL, ZERO, FORCE, ZERO, ZERO, ZERO, ZERO)
    reference = position - TRACKING if phase is Phase.LEGS else None
    return Status(time_s, phase, 0, leg_started, 0.5, estimate, reference, fallback, reason, announcements)


def _fly(summary: SummaryCollector, cycles: int = 200, *, delay_s: float = 0.0, start_s: float = 100.0) -> None:
    """Legs with truth at 125 Hz and GNSS at 100 Hz, both `delay_s` late and never at the time of a cycle."""
    for k in range(cycles):
        now = start_s + PERIOD_S * k
        samples: list[Sample] = [_truth(now - delay_s - 0.001 - 0.008 * i) for i in (1, 0)]
        samples += [_gnss(now - delay_s - 0.003 - 0.01 * i) for i in (1, 0)]
        summary.cycle(_status(now), tuple(samples))


def _rms(error: Array) -> dict[str, float]:
    x, y, z = np.abs(error).tolist()
    return {"x": x, "y": y, "z": z, "total": float(np.linalg.norm(error))}


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.4])
def test_truth_is_compared_with_where_the_flight_was_at_its_time(delay_s: float) -> None:
    """Constant errors come out exactly, however late truth and GNSS arrive: they are interpolated, not paired."""
    summary = SummaryCollector()
    _fly(summary, delay_s=delay_s)
    result = summary.result(wall_s=2.0, rejected={})
    assert result["tracking_rms_m"] == pytest.approx(_rms(TRACKING), abs=1e-5)
    assert result["estimate_rms_m"] == pytest.approx(_rms(ESTIMATE), abs=1e-5)
    assert result["gnss_rms_m"] == pytest.approx(_rms(GNSS), abs=1e-5)
    assert result["tracking_max_m"] == pytest.approx(float(np.linalg.norm(TRACKING)), abs=1e-5)
    assert result["tracking_against"] == "truth"
    assert result["force_m_s2"] == pytest.approx(FORCE.tolist())


def test_without_truth_the_estimate_stands_for_it_and_says_so() -> None:
    """On a real vehicle errors are those of the estimate, and nothing is claimed about estimate and GNSS."""
    summary = SummaryCollector()
    for k in range(100):
        summary.cycle(_status(PERIOD_S * k), (_gnss(PERIOD_S * k),))
    result = summary.result(wall_s=0.0, rejected={"position": 3})
    assert result["tracking_rms_m"] == pytest.approx(_rms(TRACKING + ESTIMATE), abs=1e-5)
    assert result["tracking_against"] == "estimate"
    assert result["estimate_rms_m"] is None
    assert result["gnss_rms_m"] is None
    assert result["rejected"] == {"position": 3}
    assert result["real_time_factor"] is None


def test_only_the_legs_count() -> None:
    """Truth and GNSS of take-off, of the way to the first leg and of the landing change no figure."""
    summary = SummaryCollector()
    wrong = np.full(3, 50.0)

    def elsewhere(status: Status) -> None:
        now = status.time_s
        truth = TruthSample(now - 0.005, wrong, ZERO, LEVEL, ZERO, ZERO)
        summary.cycle(status, (truth, _gnss(now - 0.005, 7.0 * GNSS)))

    for k in range(300):
        elsewhere(_status(90.0 + PERIOD_S * k, Phase.TAKEOFF))
    for k in range(100):
        elsewhere(_status(96.0 + PERIOD_S * k, leg_started=False))
    _fly(summary)
    for k in range(1, 300):
        elsewhere(_status(103.98 + PERIOD_S * k, Phase.ENDING))
    result = summary.result(wall_s=1.0, rejected={})
    assert result["tracking_rms_m"] == pytest.approx(_rms(TRACKING), abs=1e-5)
    assert result["estimate_rms_m"] == pytest.approx(_rms(ESTIMATE), abs=1e-5)
    assert result["gnss_rms_m"] == pytest.approx(_rms(GNSS), abs=1e-5)
    assert result["duration_s"] == pytest.approx(103.98 + PERIOD_S * 299 - 90.0)


def test_rms_and_maximum_are_those_of_a_sine() -> None:
    """An error of amplitude a over whole periods has an RMS of a / sqrt(2) and a maximum of a."""
    summary = SummaryCollector()
    n, amplitude = 500, 0.2
    for k in range(n):
        now = PERIOD_S * k
        error = np.array([amplitude * math.sin(2.0 * math.pi * 5.0 * k / n), 0.0, 0.0])
        estimate = StateEstimate(now, error, ZERO, LEVEL, ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)
        summary.cycle(Status(now, Phase.LEGS, 0, True, 0.5, estimate, ZERO), ())
    result = summary.result(wall_s=1.0, rejected={})
    assert result["tracking_rms_m"]["total"] == pytest.approx(amplitude / math.sqrt(2.0), abs=1e-5)
    assert result["tracking_max_m"] == pytest.approx(amplitude, abs=1e-5)


def test_times_are_told_as_median_99th_percentile_and_maximum() -> None:
    """Of 1..1000: 500.5, 990.01 and 1000; cycles in which nothing was solved do not count for the solver."""
    summary = SummaryCollector()
    for k in range(1, 1001):
        summary.timed(float(k), 2.0 * k)
        summary.timed(None, 1.0)
    result = summary.result(wall_s=1.0, rejected={})
    assert result["solve_ms"] == pytest.approx({"median": 500.5, "p99": 990.01, "max": 1000.0})
    assert result["cycle_ms"]["max"] == 2000.0
    assert SummaryCollector().result(wall_s=1.0, rejected={})["solve_ms"] is None


def test_a_gap_in_the_setpoints_shows_in_gap_and_rate() -> None:
    """101 setpoints at 50 Hz with one pause of half a second."""
    summary = SummaryCollector()
    for k in range(51):
        summary.setpoint_sent(PERIOD_S * k)
    for k in range(50):
        summary.setpoint_sent(1.5 + PERIOD_S * k)
    result = summary.result(wall_s=1.0, rejected={})
    assert result["setpoint_gap_max_s"] == pytest.approx(0.5)
    assert result["setpoint_rate_hz"] == pytest.approx(100.0 / 2.48, abs=1e-3)


@pytest.mark.parametrize("times_s", [(), (1.0,)])
def test_no_gap_is_claimed_without_two_setpoints(times_s: tuple[float, ...]) -> None:
    """Nothing streamed, or a single setpoint: no rate and no gap."""
    summary = SummaryCollector()
    for time_s in times_s:
        summary.setpoint_sent(time_s)
    result = summary.result(wall_s=1.0, rejected={})
    assert result["setpoint_rate_hz"] == 0.0
    assert result["setpoint_gap_max_s"] is None


def test_fallbacks_are_counted_by_name() -> None:
    """Also those of the ending, where setpoints still fly the vehicle."""
    summary = SummaryCollector()
    for k, fallback in enumerate(("", "plan", "plan", "backup")):
        summary.cycle(_status(PERIOD_S * k, fallback=fallback), ())
    summary.cycle(_status(1.0, Phase.ENDING, fallback="backup"), ())
    result = summary.result(wall_s=1.0, rejected={})
    assert result["fallbacks"] == {"plan": 2, "backup": 2}
    assert result["fallback_steps"] == 4


def test_warnings_are_told_once_and_notices_are_not() -> None:
    """Severity 4 and worse is kept, in order, each text once; the driver adds its own."""
    summary = SummaryCollector()
    summary.cycle(_status(0.0, announcements=((6, "phase legs"), (4, "gust"), (3, "late"))), ())
    summary.cycle(_status(0.1, announcements=((4, "gust"),)), ())
    summary.warn("log lost")
    summary.warn("log lost")
    assert summary.result(wall_s=1.0, rejected={})["warnings"] == ["gust", "late", "log lost"]


@pytest.mark.parametrize(
    ("phase", "reason", "outcome"),
    [(Phase.DONE, "", "completed"), (Phase.ABORTED, "stopped by Ctrl-C", "aborted"), (Phase.LEGS, "", "aborted")],
)
def test_only_a_flight_that_is_done_is_completed(phase: Phase, reason: str, outcome: str) -> None:
    """Outcome and reason are those of the last step."""
    summary = SummaryCollector()
    summary.cycle(_status(0.0), ())
    summary.cycle(_status(0.1, phase, reason=reason), ())
    result = summary.result(wall_s=1.0, rejected={}, mission="hover", seed=3)
    assert (result["outcome"], result["reason"]) == (outcome, reason)
    assert (result["mission"], result["seed"]) == ("hover", 3)


def test_a_flight_that_is_broken_off_tells_why() -> None:
    """What was collected until then stays."""
    summary = SummaryCollector()
    _fly(summary)
    summary.abort(Status(104.0, Phase.ABORTED, -1, False, 0.0, None, None, reason="internal error"))
    result = summary.result(wall_s=1.0, rejected={})
    assert (result["outcome"], result["reason"]) == ("aborted", "internal error")
    assert result["tracking_rms_m"] == pytest.approx(_rms(TRACKING), abs=1e-5)


def test_the_file_holds_what_the_summary_says(tmp_path: Path) -> None:
    """JSON, as a round trip."""
    summary = SummaryCollector()
    _fly(summary)
    result = summary.result(wall_s=1.0, rejected={"velocity": 1}, mission="hover")
    write_summary(result, tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text()) == result


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """The error says which file and why."""
    with pytest.raises(FileError, match=r"missing.*cannot be written.*No such file"):
        write_summary({}, tmp_path / "missing" / "summary.json")


def test_the_wind_of_the_legs_is_in_the_summary() -> None:
    """Mean, direction it comes from, strongest gust, least margin, and its error against the truth of its own time."""
    summary = SummaryCollector()
    winds = [wind_estimate(time_s=99.7, velocity_in_world=np.array((-4.0, 0.0)), gust_m_s=6.0, margin=0.2)]
    winds.append(wind_estimate(time_s=100.7, velocity_in_world=np.array((-6.0, 0.0)), gust_m_s=8.0, margin=0.5))
    truths = [
        TruthSample(time_s + shift_s, ZERO, ZERO, LEVEL, ZERO, np.array((east + 10.0 * shift_s, 0.4, 0.0)))
        for time_s, east in ((99.7, -4.3), (100.7, -6.3))
        for shift_s in (-0.01, 0.02)
    ]
    for k in range(100):
        now = 100.0 + PERIOD_S * k
        status = replace(_status(now), wind=winds[now >= 101.0])
        summary.cycle(
            status, tuple(truth for truth in truths if now - 0.3 <= truth.time_s + 0.015 < now - 0.3 + 2.0 * PERIOD_S)
        )
    result = summary.result(wall_s=1.0, rejected={})["wind"]
    assert (result["mean_m_s"], result["from_deg"], result["gust_m_s"], result["margin"]) == (5.0, 90.0, 8.0, 0.2)
    assert result["error_rms_m_s"] == 0.5
    assert SummaryCollector().result(wall_s=1.0, rejected={})["wind"] is None
