"""Flights with a camera: rendered, modelled, and as a stream beside a vehicle over MAVLink."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from uasfly.drivers.plan import FlightPlan, load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.drivers.sight import SightOptions
from uasfly.errors import UasflyError
from uasfly.messages import MarkerSample
from uasfly.record.reader import LogReader

PROGRAM = "from uasfly.cli.main import main; main()"
PATIENCE_S = 240.0  # for a whole flight, on a machine that is busy
LOW = ["mission.takeoff.height_m=1.0", "mission.legs[0].position_m=[0, 0, 1.0]"]


def plan(camera: str | None, *settings: str, hover_s: float = 12.0, scenario: str = "gnss_degraded") -> FlightPlan:
    """A hover."""
    legs = [f"mission.legs[0].duration_s={hover_s:g}"]
    return load_plan(
        "hover", "f550", scenario=scenario, seed=3, settings=[*legs, *settings], sight=SightOptions(camera)
    )


def sightings(log: Path) -> list[MarkerSample]:
    """What a log holds of them."""
    return [entry.message for entry in LogReader(log).messages() if isinstance(entry.message, MarkerSample)]


def test_a_bundle_in_sight_makes_the_estimate_good_where_gnss_is_not() -> None:
    """GNSS walks away by decimetres, markers hold the estimate to centimetres; sightings are as late as must be."""
    seen, blind = rehearse(plan("model")), rehearse(plan("none"))
    assert seen["outcome"] == blind["outcome"] == "completed"
    assert seen["camera"] == "vga (noise model)"
    assert blind["camera"] is blind["sightings"] is blind["by_marker"] is None
    assert seen["by_marker"]["estimate_rms_m"]["total"] < 0.03
    assert seen["by_marker"]["estimate_rms_m"]["total"] < 0.2 * blind["estimate_rms_m"]["total"]
    assert seen["by_marker"]["tracking_rms_m"]["total"] < 0.06
    assert 10.0 < seen["sightings"]["rate_hz"] < 13.0  # 0.08 s a frame
    assert seen["sightings"]["latency_ms"]["median"] > 60.0 + 80.0  # the camera's and the detector's


def test_rendered_frames_are_looked_at_and_a_flight_is_the_same_every_time(tmp_path: Path) -> None:
    """The detectors that fly find the bundle in rendered pictures; the same seed gives the same log, bit for bit."""
    slow = [*LOW, "scenario.camera.rate_hz=5"]
    logs = tmp_path / "one.mcap", tmp_path / "two.mcap"
    summaries = [rehearse(plan("vga", *slow, hover_s=2.0), log) for log in logs]
    assert logs[0].read_bytes() == logs[1].read_bytes()
    assert summaries[0]["outcome"] == "completed"
    assert summaries[0]["by_marker"]["estimate_rms_m"]["total"] < 0.1
    assert len(sightings(logs[0])) == summaries[0]["sightings"]["count"] > 10


@pytest.mark.parametrize(
    ("options", "scenario", "match"),
    [
        (SightOptions("vga"), "calm", "does not say where a bundle is"),
        (SightOptions("vga"), None, "--camera-source"),
        (SightOptions("model"), None, "belongs to rehearsals"),
        (SightOptions("no_such"), "gnss_degraded", "there is no camera"),
        (SightOptions("vga", ("four_36h11", "four_36h11")), "gnss_degraded", "different numbers"),
        (SightOptions(None, ("four_36h11",)), "gnss_degraded", "need a camera"),
    ],
)
def test_what_cannot_be_seen_with_is_refused(options: SightOptions, scenario: str | None, match: str) -> None:
    """The error says what was expected."""
    with pytest.raises(UasflyError, match=match):
        load_plan("hover", "f550", scenario=scenario, sight=options)


def test_a_mission_by_a_bundle_has_a_camera_in_simulations() -> None:
    """The board on the wall is looked at by the camera that looks ahead, the other bundle is still there."""
    sight = load_plan("marker_standoff", "f550", scenario="gnss_degraded").sight
    assert sight is not None
    assert sight.scene is not None
    assert (sight.camera.name, sight.scene.bundle.name) == ("wide_720p", "four_36h11")
    assert sight.scene.settings.bundle.on == "wall"
    assert [bundle.name for bundle, _ in sight.scene.others] == ["floor_36h11"]


def test_a_flight_over_mavlink_sees_its_bundle_in_the_cameras_stream(tmp_path: Path) -> None:
    """Vehicle, camera and detection in processes of their own: sightings come, with the time of their exposure."""
    log, summary = tmp_path / "flight.mcap", tmp_path / "summary.json"
    settings = [*LOW, "mission.legs[0].duration_s=2", "scenario.camera.rate_hz=10"]
    arguments = ["hover", "--sim", "--scenario", "gnss_degraded", "--camera", "vga", "--log", str(log)]
    arguments += [part for setting in settings for part in ("--set", setting)]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments, "--summary", str(summary)],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    result: dict[str, Any] = json.loads(summary.read_text())
    assert len(sightings(log)) == result["sightings"]["count"] > 10
    assert result["sightings"]["latency_ms"]["median"] > 60.0
    assert result["by_marker"]["estimate_rms_m"]["total"] < 0.1
