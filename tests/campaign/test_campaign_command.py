"""`uasfly campaign` as a command: dry run, errors, what it needs installed, Ctrl-C."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.campaign.conftest import SHORT, write_campaign
from uasfly.cli.main import main

COMMAND = [sys.executable, "-c", "from uasfly.cli.main import main; main()", "campaign"]
WITHOUT_EXTRA = (
    "import sys\nfor name in ('dask', 'distributed', 'pyarrow', 'matplotlib'):\n    sys.modules[name] = None\n"
)
# A shell's background job ignores Ctrl-C, and so would the tests that such a job runs.
LISTENING = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"


def _run(*arguments: str, folder: Path, code: str = "") -> subprocess.CompletedProcess[str]:
    command = list(COMMAND)
    command[2] = f"{code}{command[2]}"
    return subprocess.run([*command, *arguments], capture_output=True, text=True, check=False, cwd=folder)


def test_help_has_an_example(tmp_path: Path) -> None:
    """Like every command."""
    result = _run("--help", folder=tmp_path)
    assert result.returncode == 0
    assert "uasfly campaign gusts.yaml" in result.stdout


def test_a_dry_run_lists_and_touches_nothing(tmp_path: Path) -> None:
    """Counts, an estimate, and the commands."""
    write_campaign(tmp_path)
    result = _run("short.yaml", "--dry-run", "--json", folder=tmp_path)
    plan = json.loads(result.stdout)
    assert (plan["flights"], plan["kept"], plan["missing"], plan["folder"]) == (6, 0, 6, "short-results")
    assert len(plan["commands"]) == 6
    assert 6 * 10.0 < plan["flight_time_s"] < 6 * 60.0
    assert [path.name for path in tmp_path.iterdir()] == ["short.yaml"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.yaml",), "none.yaml: there is no such file"),
        (("short.yaml", "--workers", "2", "--scheduler", "tcp://a:1"), "give one"),
        (("short.yaml", "--out", "/proc/nothing"), "the results cannot be written"),
    ],
)
def test_wrong_input_ends_with_a_message_and_exit_code_2(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    """No traceback."""
    write_campaign(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["uasfly", "campaign", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert "Traceback" not in errors


def test_without_the_extra_one_process_flies_all_the_same(tmp_path: Path) -> None:
    """It says what is missing and how to get it; a cluster is refused."""
    write_campaign(tmp_path, SHORT.replace("[4, 8]", "[4]").replace("count: 3", "count: 1"))
    refused = _run("short.yaml", "--scheduler", "tcp://127.0.0.1:9", folder=tmp_path, code=WITHOUT_EXTRA)
    assert refused.returncode == 2
    assert "needs Dask, which is not installed: pip install 'uasfly[campaign]'" in refused.stderr
    result = _run("short.yaml", "--json", folder=tmp_path, code=WITHOUT_EXTRA)
    assert result.returncode == 0
    summary = json.loads(result.stdout)
    assert summary["flown"] == 1
    assert [note.split(" need")[0] for note in summary["notes"]] == ["flights.parquet", "the pictures"]
    assert {Path(file).name for file in summary["files"]} == {"summary.json", "report.md"}


def test_ctrl_c_says_how_to_go_on(tmp_path: Path) -> None:
    """Exit code 130, the flights that have landed are kept."""
    write_campaign(tmp_path, SHORT.replace("count: 3", "count: 300"))
    command = [*COMMAND, "short.yaml", "--workers", "1"]
    command[2] = f"{LISTENING}{command[2]}"
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        try:
            journal = tmp_path / "short-results" / "journal.jsonl"
            while not journal.exists() or b"\n" not in journal.read_bytes():
                assert running.poll() is None
                time.sleep(0.02)
            running.send_signal(signal.SIGINT)
            errors = running.communicate(timeout=60.0)[1]
        finally:
            running.kill()
    assert running.returncode == 130
    assert "of 600 flights are kept in short-results" in errors
    assert "campaign short.yaml --workers 1" in errors
    assert "Traceback" not in errors
