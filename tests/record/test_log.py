"""The flight log: what is read is what was written, and a log that breaks off is still worth reading."""

from __future__ import annotations

import math
import os
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from tests.winds import wind_estimate
from uasfly.errors import FileError
from uasfly.messages import (
    AccelerometerSample,
    FactsSample,
    FlightMode,
    NamedValue,
    OdometrySample,
    Phase,
    Request,
    RequestKind,
    RequestResult,
    RotorSample,
    StateEstimate,
    Status,
    VehicleSample,
)
from uasfly.preflight_messages import PreflightCheck, Verdict
from uasfly.record.encode import from_json, json_schema, to_json
from uasfly.record.reader import LogReader
from uasfly.record.writer import BackgroundLogWriter, LogWriter, topic_of

RNG = np.random.default_rng(3)


def _odometry(time_s: float) -> OdometrySample:
    return OdometrySample(time_s, RNG.normal(size=3), RNG.normal(size=3), RNG.normal(size=4), RNG.normal(size=3), 2)


def _status() -> Status:
    vectors = [RNG.normal(size=n) for n in (3, 3, 4, 3, 3, 3, 3, 3, 3)]
    return Status(
        1.5,
        Phase.LEGS,
        0,
        True,
        0.25,
        StateEstimate(1.5, *vectors),
        None,
        announcements=((4, "gust"), (6, "phase legs")),
    )


def _equal(a: object, b: object) -> bool:
    return to_json(a) == to_json(b) and type(a) is type(b)


@pytest.mark.parametrize(
    "message",
    [
        _odometry(0.1),
        AccelerometerSample(0.2, RNG.normal(size=3)),
        RotorSample(0.2, RNG.normal(size=6)),
        _status(),
        VehicleSample(1.0, FlightMode.OFFBOARD, armed=True, in_air=False),
        RequestResult(2.0, Request(RequestKind.TAKEOFF, 1.5), accepted=False, text="preflight"),
        FactsSample(
            3.0, (NamedValue("COM_OF_LOSS_T", 1.0), NamedValue("X", math.nan)), np.ones(3), (), (), 0.3e-3, (0.1, 0.2)
        ),
        FactsSample(3.0, (), None, (NamedValue("ODOMETRY", 99.5),), (NamedValue("late", 2.0),), math.nan, ()),
        PreflightCheck("home", Verdict.WARNING, "none", "PX4 returns there", "wait"),
    ],
    ids=lambda message: type(message).__name__,
)
def test_messages_survive_json_bit_for_bit(message: object) -> None:
    """Reading gives the same types and the same bits, nested messages, enums and missing values included."""
    again = from_json(type(message), to_json(message))
    assert _equal(again, message)


def test_floats_keep_every_bit() -> None:
    """A position read back is the same array, not a rounded one."""
    sample = _odometry(1.0 / 3.0)
    again = from_json(OdometrySample, to_json(sample))
    assert again.time_s == sample.time_s
    np.testing.assert_array_equal(again.position_in_world, sample.position_in_world)


def test_nan_becomes_null_and_comes_back_as_nan() -> None:
    """JSON has no NaN; the log stays valid JSON."""
    sample = OdometrySample(1.0, np.array([1.0, math.nan, 3.0]), np.zeros(3), np.zeros(4), np.zeros(3))
    text = to_json(sample)
    assert b"NaN" not in text
    np.testing.assert_array_equal(from_json(OdometrySample, text).position_in_world, [1.0, math.nan, 3.0])


def test_schema_names_every_field() -> None:
    """Viewers learn the fields of a message from its schema."""
    assert set(json_schema(OdometrySample)["properties"]) == set(OdometrySample.__dataclass_fields__)


def test_topics_are_readable() -> None:
    """OdometrySample is found under /odometry, RequestResult under /request_result."""
    assert topic_of(OdometrySample) == "/odometry"
    assert topic_of(RequestResult) == "/request_result"


def test_log_survives_the_round_trip(tmp_path: Path) -> None:
    """A closed log holds its description and every message in order."""
    path = tmp_path / "flight.mcap"
    written = [_odometry(0.01 * k) for k in range(300)]
    writer = LogWriter(path, {"airframe": {"name": "f550"}, "seed": 4})
    for sample in written:
        writer.write(sample, sample.time_s)
    writer.close()
    reader = LogReader(path)
    assert reader.description() == {"airframe": {"name": "f550"}, "seed": 4}
    read = list(reader.messages())
    assert reader.complete
    assert len(read) == len(written)
    assert all(_equal(a.message, b) for a, b in zip(read, written, strict=True))


def test_the_same_messages_give_the_same_bytes(tmp_path: Path) -> None:
    """Nothing of the clock, the machine or the process enters the file."""
    samples = [_odometry(0.01 * k) for k in range(100)]
    for name in ("a.mcap", "b.mcap"):
        writer = LogWriter(tmp_path / name, {"seed": 1})
        for sample in samples:
            writer.write(sample, sample.time_s)
        writer.close()
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize("fraction", [0.3, 0.55, 0.8, 0.999])
def test_a_log_cut_anywhere_gives_what_came_before(tmp_path: Path, fraction: float) -> None:
    """A log that breaks off ends early, without an error, and says that it is not complete."""
    whole = tmp_path / "whole.mcap"
    writer = LogWriter(whole, {"seed": 1})
    for k in range(600):
        writer.write(_odometry(0.01 * k), 0.01 * k)
    writer.close()
    data = whole.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(len(data) * fraction)])
    reader = LogReader(cut)
    times = [logged.log_time_s for logged in reader.messages()]
    assert not reader.complete
    assert times == sorted(times)
    assert len(times) >= 100


def test_a_killed_writer_loses_at_most_the_last_second(tmp_path: Path) -> None:
    """After SIGKILL the log holds everything up to one second before."""
    path = tmp_path / "killed.mcap"
    program = textwrap.dedent(
        """
        import sys
        import numpy as np
        from pathlib import Path
        from uasfly.messages import OdometrySample
        from uasfly.record.writer import LogWriter
        writer = LogWriter(Path(sys.argv[1]), {"seed": 1})
        z = np.zeros(3)
        for k in range(731):
            writer.write(OdometrySample(0.01 * k, z, z, np.array([1.0, 0, 0, 0]), z), 0.01 * k)
        print("written", flush=True)
        sys.stdin.read()
        """
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"written\n"
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    last = max(logged.log_time_s for logged in LogReader(path).messages())
    assert last >= 7.30 - 1.0


def test_a_full_disk_stops_the_log_but_raises_nothing() -> None:
    """The flight goes on; the writer says what happened."""
    writer = LogWriter(Path("/dev/full"), {"seed": 1})
    for k in range(200):
        writer.write(_odometry(0.01 * k), 0.01 * k)
    writer.close()
    assert "No space left" in writer.problem


def test_a_log_that_somebody_removes_is_told_and_written_on(tmp_path: Path) -> None:
    """The folder goes in flight: within a second `problem` says so; a second link to the file has everything."""
    folder, kept = tmp_path / "logs", tmp_path / "kept.mcap"
    folder.mkdir()
    writer = LogWriter(folder / "flight.mcap", {})
    writer.write(_odometry(0.0), 0.0)
    assert writer.problem == ""
    os.link(writer.path, kept)
    shutil.rmtree(folder)
    for time_s in (0.4, 0.8, 1.2):
        writer.write(_odometry(time_s), time_s)
    writer.close()
    assert "is gone" in writer.problem
    assert len(list(LogReader(kept).messages())) == 4


def test_background_writer_writes_everything(tmp_path: Path) -> None:
    """Closing waits until all that was handed over is in the file."""
    path = tmp_path / "background.mcap"
    writer = BackgroundLogWriter(path, {"seed": 1})
    for k in range(500):
        writer.write(_odometry(0.01 * k), 0.01 * k)
    writer.close()
    writer.close()
    reader = LogReader(path)
    assert len(list(reader.messages())) == 500
    assert reader.complete


def test_a_log_in_a_missing_folder_is_refused_with_the_reason(tmp_path: Path) -> None:
    """The error names the file and how to mend it."""
    with pytest.raises(FileError, match=r"No such file.*--log"):
        LogWriter(tmp_path / "missing" / "flight.mcap", {})


def test_a_file_that_is_no_log_is_refused(tmp_path: Path) -> None:
    """Reading something else says what was expected."""
    path = tmp_path / "text.mcap"
    path.write_text("hello")
    with pytest.raises(FileError, match="expected an MCAP flight log"):
        list(LogReader(path).messages())


def test_the_wind_comes_back_with_its_unknown_direction() -> None:
    """A status holds it; NaN survives, and so does that it is not known."""
    calm = Status(1.0, Phase.LEGS, 0, True, 0.5, None, None, wind=wind_estimate(mean_from_deg=math.nan))
    back = from_json(Status, to_json(calm))
    assert np.isnan(back.wind.mean_from_deg)
    np.testing.assert_array_equal(back.wind.covariance, wind_estimate().covariance)
    np.testing.assert_array_equal(back.wind.mean_in_world, wind_estimate().mean_in_world)
    assert back.wind.gust_m_s == wind_estimate().gust_m_s
    assert from_json(Status, to_json(Status(1.0, Phase.LEGS, 0, True, 0.5, None, None))).wind is None
