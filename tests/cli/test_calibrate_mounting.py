"""`uasfly calibrate mounting`: from a log to the camera's file, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from typer.testing import CliRunner

from tests.vision.mounting_scene import Flight, fly
from uasfly.camera import Camera
from uasfly.cli.main import app
from uasfly.drivers.mounting_log import read_mounting_log
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.drivers.sight import SightOptions
from uasfly.errors import FileError, UasflyError
from uasfly.files import find_file, load_file
from uasfly.messages import OdometrySample
from uasfly.record.writer import LogWriter
from uasfly.vision.calibration.camera_file import text_of, write_camera
from uasfly.vision.mounting import marker_sample
from uasfly.vision.pose import Pose
from uasfly.vision.square import quaternion_of

VGA = find_file("camera", "vga")
MISSION = """\
name: turns_and_dashes
takeoff: { height_m: 1.8 }
legs:
  - { type: circle, center_m: [0, 0], height_m: 1.8, radius_m: 0.7, period_s: 6, turns: 1.5, yaw: { rule: path } }
  - { type: back_and_forth, start_m: [-0.6, 0, 1.8], end_m: [0.6, 0, 1.8], passes: 4, yaw: { rule: fixed, yaw_deg: 0 },
      speed_m_s: 1.5, acceleration_m_s2: 3, jerk_m_s3: 20 }
  - { type: back_and_forth, start_m: [0, -0.6, 1.8], end_m: [0, 0.6, 1.8], passes: 4, yaw: { rule: fixed, yaw_deg: 0 },
      speed_m_s: 1.5, acceleration_m_s2: 3, jerk_m_s3: 20 }
ending: { action: land }
limits: { geofence: { radius_m: 5 }, altitude_min_m: 0.5, altitude_max_m: 5, wind_m_s: 5 }
"""


def run(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and output; an error that the user sees as a message is 2, as in `main`."""
    result = CliRunner().invoke(app, ["calibrate", "mounting", *map(str, arguments)], env={"COLUMNS": "200"})
    if isinstance(result.exception, UasflyError):
        return 2, str(result.exception)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def write_log(path: Path, flight: Flight, camera: Camera) -> Path:
    """The log of a flight, as if its sightings had gone through this camera's mounting."""
    writer = LogWriter(path, {"sight": {"camera": camera.model_dump(mode="json")}})
    motion, seen = flight.motion, flight.sightings
    rows = zip(
        motion.time_s, motion.position_in_world, motion.velocity_in_world, motion.quaternion_body_to_world,
        motion.rate_in_body, motion.resets, strict=True,
    )  # fmt: skip
    for time_s, position, velocity, quaternion, rate, resets in rows:
        writer.write(OdometrySample(float(time_s), position, velocity, quaternion, rate, int(resets)), float(time_s))
    for index, time_s in enumerate(seen.time_s):
        pose = Pose(seen.position[index], quaternion_of(seen.rotation[index]))
        sample = marker_sample(camera, seen.ids[seen.bundle[index]], float(time_s), pose, seen.covariance[index])
        writer.write(sample, float(time_s) + 0.1)
    writer.close()
    return path


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Log of a rehearsal whose camera is mounted otherwise than its file says."""
    folder = tmp_path_factory.mktemp("rehearsed")
    mission = folder / "mission.yaml"
    mission.write_text(MISSION)
    settings = [
        "scenario.camera.mounting_error_deg=[1.5, -2, 1]",
        "scenario.camera.mounting_error_m=[0.03, -0.02, 0.01]",
        "scenario.sensors.gnss.random_walk_m_sqrt_s=0.05",
    ]
    plan = load_plan(
        str(mission), "f550", scenario="gnss_degraded", seed=2, settings=settings, sight=SightOptions("model")
    )
    assert rehearse(plan, folder / "flight.mcap")["outcome"] == "completed"
    return folder / "flight.mcap"


def test_a_rehearsed_flight_gives_the_true_mounting_back(rehearsed: Path, tmp_path: Path) -> None:
    """Rotation to a quarter of a degree, lever arm inside its sigmas; the camera's file keeps all else."""
    out = tmp_path / "mine.yaml"
    out.write_text("# my camera\n" + VGA.read_text())
    arguments = rehearsed, "--camera", out, "--out", out
    code, text = run(*arguments)
    assert code == 2
    assert "--overwrite" in text
    code, text = run(*arguments, "--overwrite", "--latency", "--json")
    assert code == 0, text
    record: dict[str, Any] = json.loads(text)
    camera, before = load_file(out, Camera), load_file(VGA, Camera)
    placement = before.transform_camera_to_body
    true = Rotation.from_matrix(placement.rotation) * Rotation.from_rotvec((1.5, -2.0, 1.0), degrees=True)
    turn = true * Rotation.from_matrix(camera.transform_camera_to_body.rotation).inv()
    moved = placement.position + np.array((0.03, -0.02, 0.01)) - camera.transform_camera_to_body.position
    assert turn.magnitude() < math.radians(0.25)
    error = np.concatenate((turn.as_rotvec(), moved))
    assert error @ np.linalg.solve(np.array(record["covariance"]), error) < chi2.ppf(0.999, 6)
    assert 0.0 < camera.mounting_sigma_m < 0.05
    assert 0.0 < camera.mounting_sigma_deg < 0.3
    assert camera.latency_s == pytest.approx(0.06, abs=0.002)  # no error of the clock in a rehearsal
    changed = {"transform_camera_to_body", "mounting_sigma_m", "mounting_sigma_deg", "latency_s"}
    assert camera.model_dump(exclude=changed) == before.model_dump(exclude=changed)
    written = out.read_text()
    assert written.startswith("# mounting: calibrated on ")
    assert "# my camera" in written
    assert "# down, the picture's top to the nose" in written
    assert (tmp_path / "mine.png").stat().st_size > 10_000
    assert {path.name for path in tmp_path.iterdir()} == {"mine.yaml", "mine.png"}


def test_without_a_camera_file_the_logs_own_is_completed(tmp_path: Path) -> None:
    """And the table names values, sigmas and what was written."""
    out = tmp_path / "new.yaml"
    log = write_log(tmp_path / "a.mcap", fly(20, duration_s=20.0), load_file(VGA, Camera))
    code, text = run(log, "--out", out)
    assert code == 0, text
    assert "new.yaml: mounting written" in text
    assert "sightings left out" in text
    assert load_file(out, Camera).distortion == load_file(VGA, Camera).distortion


def test_a_mounting_that_is_not_known_is_not_written(tmp_path: Path) -> None:
    """Exit code 1 and what to do; with the file's own sigmas as a measurement it is known and written."""
    camera = load_file(VGA, Camera)
    log = write_log(tmp_path / "still.mcap", fly(21, duration_s=15.0, yaw_rad=0.0, tilt_rad=0.002), camera)
    out = tmp_path / "mine.yaml"
    code, text = run(log, "--camera", VGA, "--out", out)
    assert code == 1
    assert not out.exists()
    assert "Roll and pitch it" in " ".join(text.split())
    code, text = run(log, "--camera", VGA, "--out", out, "--prior", "--json")
    assert code == 0
    assert json.loads(text)["missing"] is None
    assert load_file(out, Camera).mounting_sigma_m == pytest.approx(camera.mounting_sigma_m, rel=0.1)


def test_a_log_gives_back_what_the_camera_saw(tmp_path: Path) -> None:
    """The mounting that the sightings were made with is taken out again, also of a poor one's covariance."""
    flight = fly(22, duration_s=4.0)
    camera = load_file(VGA, Camera).model_copy(update={"mounting_sigma_m": 0.05, "mounting_sigma_deg": 5.0})
    read = read_mounting_log(write_log(tmp_path / "a.mcap", flight, camera))
    assert read.complete
    assert read.camera.model_dump() == camera.model_dump()
    np.testing.assert_array_equal(read.motion.position_in_world, flight.motion.position_in_world)
    np.testing.assert_allclose(read.sightings.position, flight.sightings.position, atol=1e-9)
    np.testing.assert_allclose(read.sightings.rotation, flight.sightings.rotation, atol=1e-9)
    np.testing.assert_allclose(read.sightings.covariance, flight.sightings.covariance, atol=1e-12)


def test_bad_logs_are_refused_with_the_reason(tmp_path: Path) -> None:
    """No log, a flight without a camera, one that saw nothing or too little: exit code 2 and what was expected."""
    camera = {"camera": load_file(VGA, Camera).model_dump(mode="json")}
    text = tmp_path / "text.mcap"
    text.write_text("hello")
    cases: tuple[tuple[str, object, str], ...] = (
        ("blind.mcap", None, "flight with a camera"),
        ("odd.mcap", {"camera": {"name": "x"}}, "cannot be used"),
        ("empty.mcap", camera, "sightings of a bundle"),
    )
    for name, sight, expected in cases:
        LogWriter(tmp_path / name, {"sight": sight}).close()
        code, told = run(tmp_path / name)
        assert code == 2
        assert expected in told
        assert name in told
    assert run(text)[0] == run(tmp_path / "missing.mcap")[0] == 2
    short = write_log(tmp_path / "short.mcap", fly(23, duration_s=3.0), load_file(VGA, Camera))
    code, told = run(short)
    assert code == 2
    assert "short.mcap: expected at least 30 sightings" in told
    code, told = run(short, "--out", tmp_path / "none" / "x.yaml")
    assert code == 2
    assert "folder" in told


def test_a_log_with_odd_samples_is_read_without_them(tmp_path: Path) -> None:
    """Not finite, no attitude, twice the same time: they are left out."""
    flight = fly(24, duration_s=4.0)
    path = write_log(tmp_path / "odd.mcap", flight, load_file(VGA, Camera))
    motion = flight.motion
    motion.position_in_world[10, 0] = math.nan
    motion.quaternion_body_to_world[20] = 0.0
    motion.time_s[30] = motion.time_s[31]
    again = read_mounting_log(write_log(path, flight, load_file(VGA, Camera))).motion
    assert len(again.time_s) == len(motion.time_s) - 3
    assert (np.diff(again.time_s) > 0.0).all()


def test_a_camera_in_memory_becomes_a_file_and_back(tmp_path: Path) -> None:
    """As it is written without a base."""
    camera = load_file(VGA, Camera)
    assert write_camera(tmp_path / "camera.yaml", text_of(camera)) == camera
    with pytest.raises(FileError):
        write_camera(tmp_path / "bad.yaml", text_of(camera).replace("fx:", "f:"))
    assert not (tmp_path / "bad.yaml").exists()


def test_options_that_do_not_go_together_are_refused(tmp_path: Path) -> None:
    """A recording needs camera, frames and bundle; a log needs none of them; sigmas of zero are no measurement."""
    log = write_log(tmp_path / "a.mcap", fly(25, duration_s=8.0), load_file(VGA, Camera))
    code, told = run(log, "--bundle", "four_36h11")
    assert code == 2
    assert "belong to --connect" in told
    code, told = run(tmp_path / "new.mcap", "--connect", "udpin://127.0.0.1:1", "--camera", VGA)
    assert code == 2
    assert "--camera-source" in told
    sure = tmp_path / "sure.yaml"
    sure.write_text(VGA.read_text().replace("mounting_sigma_m: 0.005", "mounting_sigma_m: 0"))
    code, told = run(log, "--camera", sure, "--prior")
    assert code == 2
    assert "say how well it was measured" in told
    code, told = run(log, "--camera", "no_such")
    assert code == 2
