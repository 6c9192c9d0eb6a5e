"""Recording a vehicle that is carried by hand: everything is in the log, nothing is sent, an armed one is refused."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from tests.cli.test_calibrate_mounting import VGA
from tests.vision.mounting_scene import Flight, fly
from uasfly.camera import Camera
from uasfly.drivers.hand_held import Recorded, collect, record_hand_held
from uasfly.drivers.mounting_log import read_mounting_log
from uasfly.drivers.sight import Sight
from uasfly.errors import FileError, UasflyError
from uasfly.files import load_file
from uasfly.messages import FlightMode, MarkerSample, OdometrySample, Sample, VehicleSample
from uasfly.record.writer import LogWriter
from uasfly.vision.frames import Announcement
from uasfly.vision.mounting import marker_sample
from uasfly.vision.pose import Pose
from uasfly.vision.square import quaternion_of

CAMERA = load_file(VGA, Camera)


class Carried:
    """Link and eyes of a vehicle that is carried, on a clock of its own; there is nothing to send with."""

    def __init__(self, flight: Flight, *, armed_at_s: float = 1e9, stop_at_s: float = 1e9) -> None:
        self.now_s = 0.0
        self._before_s = -1.0
        self._seen_s = -1.0
        self._flight, self._armed_at_s, self._stop_at_s = flight, armed_at_s, stop_at_s

    def clock(self) -> float:
        """Its time [s]."""
        return self.now_s

    def poll(self) -> tuple[Sample, ...]:
        """Odometry since the last call, and the vehicle's state."""
        motion, samples = self._flight.motion, []
        for index, time_s in enumerate(motion.time_s):
            if self._before_s < time_s <= self.now_s:
                samples.append(
                    OdometrySample(
                        float(time_s),
                        motion.position_in_world[index],
                        motion.velocity_in_world[index],
                        motion.quaternion_body_to_world[index],
                        motion.rate_in_body[index],
                    )
                )
        self._before_s = self.now_s
        state = VehicleSample(self.now_s, FlightMode.HOLD, armed=self.now_s >= self._armed_at_s, in_air=False)
        return (*samples, state)

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Time goes on."""
        self.now_s += timeout_s
        if self.now_s > self._stop_at_s:
            self._stop_at_s = 1e9
            raise asyncio.CancelledError
        return True

    def look(self) -> tuple[MarkerSample, ...]:
        """Sightings since the last call."""
        seen = self._flight.sightings
        fresh = [k for k, time_s in enumerate(seen.time_s) if self._seen_s < time_s <= self.now_s]
        self._seen_s = self.now_s
        return tuple(
            marker_sample(
                CAMERA,
                3,
                float(seen.time_s[k]),
                Pose(seen.position[k], quaternion_of(seen.rotation[k])),
                seen.covariance[k],
            )
            for k in fresh
        )

    def take_announcements(self) -> list[Announcement]:
        """A camera that stutters."""
        return [(4, "the camera is lost")] if self.now_s > 1.0 else []


def record(path: Path, carried: Carried, duration_s: float, told: list[str]) -> Recorded:
    """A recording."""
    writer = LogWriter(path, {"sight": Sight(CAMERA, ()).description(), "hand_held": True})

    def tell(text: str, done: float) -> None:
        told.append(f"{done:.2f} {text}")

    try:
        return asyncio.run(collect(carried, carried, writer, duration_s, tell, carried.clock))
    finally:
        writer.close()


def test_a_recording_is_a_log_that_a_mounting_can_be_calibrated_from(tmp_path: Path) -> None:
    """All odometry and sightings of its time are in it; what goes on is told."""
    told: list[str] = []
    recorded = record(tmp_path / "hand.mcap", Carried(fly(1, duration_s=5.0)), 4.0, told)
    log = read_mounting_log(tmp_path / "hand.mcap")
    assert log.complete
    assert recorded.odometry == len(log.motion.time_s) >= 390
    assert recorded.sightings == len(log.sightings.time_s) >= 26
    assert len(told) == 7
    assert told[0].endswith(" 1 sightings")
    assert "the camera is lost" in told[-1]


def test_an_armed_vehicle_is_not_recorded(tmp_path: Path) -> None:
    """Carrying it would be dangerous; what was recorded before is kept."""
    with pytest.raises(UasflyError, match="disarm it"):
        record(tmp_path / "hand.mcap", Carried(fly(1, duration_s=3.0), armed_at_s=1.0), 2.0, [])
    assert read_mounting_log(tmp_path / "hand.mcap").motion.time_s[-1] == pytest.approx(0.95, abs=0.06)


def test_an_interrupted_recording_counts(tmp_path: Path) -> None:
    """Ctrl-C ends it early, and what there is is returned."""
    recorded = record(tmp_path / "hand.mcap", Carried(fly(1, duration_s=3.0), stop_at_s=1.5), 60.0, [])
    assert 140 <= recorded.odometry <= 160


def test_a_log_that_is_there_is_not_written_over(tmp_path: Path) -> None:
    """Nothing is connected to before."""
    path = tmp_path / "hand.mcap"
    path.write_text("mine")
    with pytest.raises(FileError, match="there already"):
        record_hand_held("udpin://127.0.0.1:1", Sight(CAMERA, ()), path, 1.0, lambda _text, _done: None)
    assert path.read_text() == "mine"
