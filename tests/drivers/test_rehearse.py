"""Rehearsals: whole flights in one process, deterministic, and better than the paper's backup PIDs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from uasfly.drivers.plan import FlightPlan, load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.errors import FileError, UasflyError
from uasfly.frames import euler_from_quaternion
from uasfly.messages import AttitudeTargetSample, OdometrySample, Phase, Setpoint, Status, TruthSample
from uasfly.record.reader import LogReader

SHORT = ["mission.legs[0].duration_s=8"]


def _short(seed: int = 1, scenario: str = "blower_hover") -> FlightPlan:
    return load_plan("hover", "f550", scenario=scenario, seed=seed, settings=SHORT)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """One short flight and its log."""
    log = tmp_path_factory.mktemp("flown") / "flight.mcap"
    return rehearse(_short(), log), log


def test_a_flight_completes_and_its_summary_says_everything(flown: tuple[dict[str, Any], Path]) -> None:
    """Outcome, errors, rates, times, fallbacks, rejections, force and warnings are all there."""
    summary, _ = flown
    assert summary["outcome"] == "completed"
    assert summary["reason"] == ""
    assert {"airframe", "scenario", "seed", "mission", "controller"} <= set(summary)
    for key in ("tracking_rms_m", "estimate_rms_m", "gnss_rms_m"):
        assert set(summary[key]) == {"x", "y", "z", "total"}
    assert summary["tracking_against"] == "truth"
    assert 0.0 < summary["estimate_rms_m"]["total"] < summary["gnss_rms_m"]["total"]
    assert 0.015 < summary["gnss_rms_m"]["total"] < 0.02  # 1 cm on each axis
    assert set(summary["solve_ms"]) == set(summary["cycle_ms"]) == {"median", "p99", "max"}
    assert summary["setpoint_rate_hz"] == pytest.approx(50.0, abs=0.01)
    assert summary["setpoint_gap_max_s"] == pytest.approx(0.02, abs=1e-9)
    assert summary["fallback_steps"] == 0
    assert len(summary["force_m_s2"]) == 3


def test_the_same_seed_gives_the_same_log_bit_for_bit(flown: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    """Nothing of the clock or the process enters a rehearsal."""
    again = tmp_path / "again.mcap"
    rehearse(_short(), again)
    assert again.read_bytes() == flown[1].read_bytes()


def test_another_seed_gives_another_flight(flown: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    """The seed reaches noise and turbulence."""
    other = rehearse(_short(seed=2))
    assert other["tracking_rms_m"] != flown[0]["tracking_rms_m"]


def test_the_log_holds_the_whole_flight(flown: tuple[dict[str, Any], Path]) -> None:
    """Every cycle's status, every setpoint, the odometry at 100 Hz, truth, and what was flown."""
    summary, path = flown
    reader = LogReader(path)
    assert reader.description()["airframe"]["name"] == "f550"
    logged = list(reader.messages())
    assert reader.complete
    kinds = [type(entry.message) for entry in logged]
    cycles = summary["duration_s"] * 50.0
    assert kinds.count(Status) == pytest.approx(cycles, abs=2)
    assert kinds.count(TruthSample) == kinds.count(Status)
    assert kinds.count(OdometrySample) == pytest.approx(2.0 * cycles, rel=0.01)
    assert logged[-1].message.phase is Phase.DONE
    setpoints = [entry.message for entry in logged if isinstance(entry.message, Setpoint)]
    assert all(0.0 <= setpoint.thrust <= 1.0 for setpoint in setpoints)


def test_the_hand_over_is_bumpless(flown: tuple[dict[str, Any], Path]) -> None:
    """What is streamed before offboard is what PX4 is being told; the switch changes no more than any cycle does."""
    told: AttitudeTargetSample | None = None
    switch_s = math.inf
    streamed, errors = [], []
    for message in (entry.message for entry in LogReader(flown[1]).messages()):
        if isinstance(message, AttitudeTargetSample):
            told = message
        elif isinstance(message, Status) and message.phase is Phase.LEGS:
            switch_s = min(switch_s, message.time_s)
        elif isinstance(message, Setpoint):
            streamed.append((message.time_s, message.roll_rad, message.pitch_rad, message.thrust))
            if math.isinf(switch_s) and told is not None:
                roll, pitch, _ = euler_from_quaternion(told.quaternion_body_to_world)
                errors.append((message.roll_rad - roll, message.pitch_rad - pitch, message.thrust - told.thrust))
    first = next(k for k, row in enumerate(streamed) if row[0] >= switch_s)
    assert len(errors) > 20
    assert float(np.abs(np.array(errors[:-1])).max()) < 1e-9
    steps = np.abs(np.diff(np.array(streamed), axis=0))[:, 1:]
    assert np.all(steps[first - 1] <= steps[first + 50 :].max(axis=0))


@pytest.mark.parametrize(("mission", "scenario", "limit_m"), [("hover", "blower_hover", 0.05)])
def test_wind_is_held_twice_as_well_as_by_the_backup_pids(mission: str, scenario: str, limit_m: float) -> None:
    """The blower's whole programme: below the limit, and less than half of what the PIDs stray on the same seed."""
    nmpc = rehearse(load_plan(mission, "f550", scenario=scenario, seed=1))
    pid = rehearse(load_plan(mission, "f550", scenario=scenario, seed=1, controller="pid"))
    assert nmpc["outcome"] == pid["outcome"] == "completed"
    assert nmpc["tracking_rms_m"]["total"] <= limit_m
    assert pid["tracking_rms_m"]["total"] >= 2.0 * nmpc["tracking_rms_m"]["total"]


def test_each_controller_of_waslander_strays_less_than_the_one_before() -> None:
    """In sum-of-sines gusts, a short hover: backup PIDs, double derivative, wind compensation beside it."""
    settings = ["scenario.wind.gusts=sum_of_sines", "mission.legs[0].duration_s=8"]
    strays = []
    for controller in ("pid", "pid_dd", "pid_dd_wind"):
        plan = load_plan("hover", "f550", scenario="gusty", seed=2, controller=controller, settings=settings)
        summary = rehearse(plan)
        assert (summary["outcome"], summary["controller"]) == ("completed", controller)
        strays.append(summary["tracking_rms_m"]["total"])
    assert strays[2] < 0.7 * strays[1] < 0.7 * strays[0]


def test_setpoints_do_not_jump_in_gusts_that_cannot_be_held(tmp_path: Path) -> None:
    """Gusts of 9 m/s^2, 5.7 can be held: leaned over to the limit, roll and thrust stay steady instead of chattering.

    Planned against the force as estimated, this flight has 50 jumps of roll and 29 of thrust.
    """
    settings = ["scenario.wind.mean.speed_at_10_m_m_s=14", "mission.legs[0].duration_s=15"]
    settings += [f"mission.monitors.{name}.action=warn" for name in ("wind", "tracking", "geofence", "altitude")]
    settings += ["mission.monitors.tracking.then=warn"]
    log = tmp_path / "strong.mcap"
    summary = rehearse(load_plan("hover", "f550", scenario="gusty", seed=2, settings=settings), log)
    assert not any("contradicts" in text or "jumped" in text for text in summary["warnings"])  # it is pushed
    setpoints = [entry.message for entry in LogReader(log).messages() if isinstance(entry.message, Setpoint)]
    rolls = np.diff([setpoint.roll_rad for setpoint in setpoints])
    thrusts = np.diff([setpoint.thrust for setpoint in setpoints])
    assert int((np.abs(rolls) > 0.4).sum()) == 0
    assert int((np.abs(thrusts) > 0.25).sum()) <= 3


def test_every_shipped_mission_is_flown_to_its_end() -> None:
    """Shortened where it can be, each mission completes in calm air."""
    shorter = {
        "hover": ["mission.legs[0].duration_s=2"],
        "back_and_forth": ["mission.legs[0].duration_s=20"],
        "spiral": ["mission.legs[0].turns=0.5", "mission.legs[0].duration_s=20"],
    }
    for mission in ("hover", "back_and_forth", "spiral", "line"):
        summary = rehearse(load_plan(mission, "f550", scenario="calm", settings=shorter.get(mission, [])))
        assert summary["outcome"] == "completed", (mission, summary["reason"])
        assert summary["tracking_rms_m"]["total"] < 0.05, mission


def test_settings_reach_their_files() -> None:
    """--set changes the named field of the named file and nothing else."""
    plan = load_plan("hover", "f550", scenario="calm", settings=["airframe.model.drag_1_s=[0.3, 0.3, 0.3]"])
    assert plan.airframe.model.drag_1_s == (0.3, 0.3, 0.3)


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        (["foo=1"], "begins with"),
        (["airframe.limits.tilt=1"], "tilt"),
        (["airframe.limits.tilt_deg=abc"], "expected a number"),
        (["nonsense"], "key=value"),
    ],
)
def test_wrong_settings_are_refused(settings: list[str], match: str) -> None:
    """The error says what was expected."""
    with pytest.raises(UasflyError, match=match):
        load_plan("hover", "f550", scenario="calm", settings=settings)


def test_an_unknown_controller_is_refused() -> None:
    """The error lists the controllers."""
    with pytest.raises(UasflyError, match="nmpc, pid"):
        load_plan("hover", "f550", controller="lqr")


def test_an_unknown_mission_is_refused_with_what_there_is() -> None:
    """The error lists the shipped missions."""
    with pytest.raises(FileError, match="back_and_forth"):
        load_plan("hoover", "f550")
