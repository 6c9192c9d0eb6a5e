"""Campaigns that are flown: the same rows wherever, whatever was killed; errors are rows; one campaign a folder."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import dask
import psutil
import pytest
from distributed import LocalCluster

from tests.campaign.conftest import SHORT, listed, run, write_campaign
from uasfly.campaign import cluster, execute
from uasfly.campaign.campaign_file import Success
from uasfly.campaign.cluster import check_workers, fly_on, remote_client
from uasfly.campaign.fly import fly
from uasfly.campaign.folder import JOURNAL, ResultsFolder
from uasfly.campaign.identity import code_digest, facts
from uasfly.campaign.run import Where
from uasfly.campaign.table import Row, read_parquet, same_rows, succeeded, without_timing
from uasfly.errors import FileError, UasflyError

Undisturbed = tuple[Path, list[Row], dict[str, Any]]
TABLE = "flights.parquet"
PROGRAM = "if __name__ == '__main__':\n    from uasfly.cli.main import main; main()\n"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster of two worker processes that somebody else has started."""
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as workers,
    ):
        yield workers.scheduler_address


def program(folder: Path, *arguments: str) -> list[str]:
    """The command line, from a file: worker processes import the main module."""
    (folder / "uasfly_main.py").write_text(PROGRAM)
    return [sys.executable, str(folder / "uasfly_main.py"), *arguments]


def test_a_row_holds_what_was_flown_and_what_came_of_it(undisturbed: Undisturbed) -> None:
    """Through Parquet and back, in the order of the campaign."""
    _, rows, summary = undisturbed
    assert [row["index"] for row in rows] == list(range(6))
    assert all(row["outcome"] == "completed" and row["tracking_rms_m"] > 0.0 for row in rows)
    assert [row["scenario.wind.mean.speed_at_10_m_m_s"] for row in rows] == [4.0] * 3 + [8.0] * 3
    assert all(row["mission.ending.action"] == '"hold"' and 1.4 < row["plant.mass_kg"] < 2.2 for row in rows)
    assert summary["told"].begun == (0, 6, 0)
    assert summary["told"].landings == [row["success"] for row in rows]
    assert summary["successes"] == sum(row["success"] for row in rows)
    assert [group["flights"] for group in summary["groups"]] == [3, 3]


def test_everything_is_written(undisturbed: Undisturbed) -> None:
    """Table, summary, report and pictures; nothing half written is left."""
    out, rows, summary = undisturbed
    names = {JOURNAL, "lock", TABLE, "summary.json", "report.md", "rms.png", "wind.png", "worst.png"}
    assert {path.name for path in out.iterdir()} == names
    assert json.loads((out / "summary.json").read_text())["groups"][0]["flights"] == 3
    report = (out / "report.md").read_text()
    assert "speed_at_10_m_m_s=8" in report
    assert summary["worst"][0]["command"] in report
    assert summary["worst"][0]["tracking_rms_m"] == max(row["tracking_rms_m"] for row in rows)
    assert (out / "rms.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_of_a_row_gives_its_figures(undisturbed: Undisturbed, tmp_path: Path) -> None:
    """As written, in a shell."""
    row = undisturbed[1][-1]
    words = shlex.split(row["command"])[1:]
    result = subprocess.run(program(tmp_path, *words, "--json"), capture_output=True, text=True, check=True)
    summary = json.loads(result.stdout)
    assert summary["tracking_rms_m"]["total"] == row["tracking_rms_m"]
    assert summary["tracking_max_m"] == row["tracking_max_m"]
    assert summary["duration_s"] == row["duration_s"]


def test_a_killed_campaign_goes_on_and_ends_in_the_same_rows(undisturbed: Undisturbed, tmp_path: Path) -> None:
    """Killed with SIGKILL in two worker processes: they end too, and only what is missing is flown again."""
    path, out = write_campaign(tmp_path), tmp_path / "out"
    command = program(tmp_path, "campaign", str(path), "--out", str(out), "--workers", "2")
    killed = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    journal = out / JOURNAL
    while not journal.exists() or b"\n" not in journal.read_bytes():
        assert killed.poll() is None
        time.sleep(0.02)
    workers = psutil.Process(killed.pid).children(recursive=True)
    killed.kill()
    killed.wait()
    assert not psutil.wait_procs(workers, timeout=60.0)[1]
    with journal.open("ab") as stream:
        stream.write(b'{"id": "half a li')
    kept = journal.read_bytes().count(b"\n")
    assert kept >= 1
    summary = json.loads(
        subprocess.run(
            [*command, "--json"], capture_output=True, text=True, check=True
        ).stdout  # in two processes again
    )
    assert summary["flown"] == 6
    assert journal.read_bytes().count(b"\n") == 6
    assert same_rows(read_parquet(out / TABLE), undisturbed[1])


def test_a_cluster_gives_the_same_rows(undisturbed: Undisturbed, address: str, tmp_path: Path) -> None:
    """Two workers that were there before, which get no file names."""
    summary = run(listed(tmp_path), tmp_path / "out", Where(scheduler=address))
    assert len(summary["told"].landings) == 6
    rows = read_parquet(tmp_path / "out" / TABLE)
    assert same_rows(rows, undisturbed[1])
    assert len({row["timing_worker"] for row in rows}) == 2


class _Deadly:
    """A plan that ends the process which unpacks it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os._exit, (1,)


def test_a_flight_that_kills_its_worker_becomes_a_row(address: str, tmp_path: Path) -> None:
    """The others are flown nevertheless."""
    flights = listed(tmp_path)

    def plan_of(flight: Any) -> Any:
        return _Deadly() if flight.index == 0 else flights.plan(flight)

    with remote_client(address) as client:
        results = {
            flight.index: result for flight, result in fly_on(client, flights.flights[:2], plan_of, code_digest())
        }
    assert results[0]["outcome"] == "error"
    assert "died" in results[0]["reason"]
    assert results[1]["outcome"] == "completed"


def test_workers_with_another_version_are_refused(address: str) -> None:
    """Each of them is named, with what it has and what was expected."""
    with remote_client(address) as client:
        check_workers(client, facts())
        with pytest.raises(UasflyError, match=r"uasfly 0\.\d+\.\d+, here 99\.0"):
            check_workers(client, {**facts(), "uasfly": "99.0"})


def test_nobody_at_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused with the address and the form that is expected."""
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT_S", 0.3)
    for address in ("tcp://127.0.0.1:9", "carrier-pigeon"):
        with pytest.raises(UasflyError, match=f"--scheduler {address}: no Dask scheduler can be reached"):
            run(listed(tmp_path), tmp_path / "out", Where(scheduler=address))


def test_flights_that_raise_are_rows_and_flown_again(
    undisturbed: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The campaign goes on; what has flown well stays."""

    def failing(pickled: bytes, code: str) -> dict[str, Any]:
        result = fly(b"no plan at all" if len(tried) == 1 else pickled, code)
        tried.append(result["outcome"])
        return result

    tried: list[str] = []
    monkeypatch.setattr(execute, "fly", failing)
    text = SHORT.replace("[4, 8]", "[4]")
    summary = run(listed(tmp_path, text), tmp_path / "out")
    assert tried == ["completed", "error", "completed"]
    assert summary["errors"] == 1
    row = read_parquet(tmp_path / "out" / TABLE)[1]
    assert row["reason"].startswith("internal error: UnpicklingError")
    assert row["tracking_rms_m"] is None
    again = run(listed(tmp_path, text), tmp_path / "out")
    assert tried[3:] == ["completed"]
    assert again["told"].begun == (2, 3, 2)
    assert same_rows(read_parquet(tmp_path / "out" / TABLE), undisturbed[1][:3])


def test_ctrl_c_that_a_flight_has_swallowed_is_not_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The campaign stops after that flight, and what may have been disturbed is not kept."""

    def swallowing(pickled: bytes, code: str) -> dict[str, Any]:
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60.0)
        return {"outcome": "completed"}

    monkeypatch.setattr(execute, "fly", swallowing)
    with pytest.raises(KeyboardInterrupt):
        run(listed(tmp_path), tmp_path / "out")
    assert (tmp_path / "out" / JOURNAL).read_bytes() == b""
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_worker_with_other_code_flies_nothing(tmp_path: Path) -> None:
    """It may have joined when the versions had been compared already."""
    assert "another uasfly" in fly(b"", "other code")["reason"]


def test_a_changed_campaign_keeps_what_still_matches(
    undisturbed: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is flown for another order or measure of success; flights that fell out are left out, and it says so."""
    out = tmp_path / "out"
    out.mkdir()
    (out / JOURNAL).write_bytes((undisturbed[0] / JOURNAL).read_bytes())
    monkeypatch.setattr(execute, "fly", None)
    said: list[str] = []
    changed = SHORT.replace("[4, 8]", "[8]").replace("{ first: 1, count: 3 }", "[3, 1]")
    changed = changed.replace("success: { tracking_rms_m: 0.05 }", "success: { tracking_rms_m: 0.000001 }")
    summary = run(listed(tmp_path, changed), out, said=said)
    assert said == [f"4 flights in {out} are not of this campaign as it is now; they are left out of the results"]
    assert (summary["flown"], summary["successes"]) == (2, 0)
    rows, before = read_parquet(out / TABLE), undisturbed[1]
    assert [row["id"] for row in rows] == [before[5]["id"], before[3]["id"]]
    assert [row["index"] for row in rows] == [0, 1]


def test_success_is_a_completed_flight_within_the_measure() -> None:
    """An aborted flight is none, however well it tracked."""
    strict, plain = Success(tracking_rms_m=0.05), Success()
    good = {"outcome": "completed", "tracking_rms_m": 0.04}
    assert succeeded(good, strict)
    assert succeeded({**good, "tracking_rms_m": 0.06}, plain)
    assert not succeeded({**good, "tracking_rms_m": 0.06}, strict)
    assert not succeeded({**good, "tracking_rms_m": None}, strict)
    assert not succeeded({**good, "outcome": "aborted"}, plain)


def test_only_timing_may_differ(undisturbed: Undisturbed) -> None:
    """`same_rows` sees every figure but those of the machine."""
    rows = undisturbed[1]
    assert same_rows(rows, [{**row, "timing_wall_s": 1.0} for row in rows])
    assert not same_rows(rows, [{**row, "rejected": 10**6} for row in rows])
    assert not same_rows(rows, rows[:-1])
    assert "timing_worker" in rows[0]
    assert "timing_worker" not in without_timing(rows[0])


def test_a_folder_takes_one_campaign_at_a_time(tmp_path: Path) -> None:
    """The second is refused while the first holds the lock, and not after it."""
    words = f"another campaign is writing here .process {os.getpid()}."
    with ResultsFolder(tmp_path / "out"), pytest.raises(FileError, match=words):
        run(listed(tmp_path), tmp_path / "out")
    with (tmp_path / "out" / "lock").open("a") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nothing"])
def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path, place: str) -> None:
    """With what is to be done about it."""
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match=r"the results cannot be written: .*choose another --out"):
        run(listed(tmp_path), tmp_path / place)


def test_a_full_disk_ends_the_campaign_with_a_message(tmp_path: Path) -> None:
    """What was written before stays readable."""
    with ResultsFolder(tmp_path) as folder:
        folder.keep("one", {"outcome": "completed"})
        with Path("/dev/full").open("wb", buffering=0) as full:
            folder._journal, journal = full, folder._journal
            with pytest.raises(FileError, match="the results cannot be written: No space left on device; make room"):
                folder.keep("two", {"outcome": "completed"})
            folder._journal = journal
    with ResultsFolder(tmp_path) as folder:
        assert set(folder.results) == {"one"}
