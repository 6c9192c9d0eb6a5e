"""Recommended settings in an airframe file."""

from __future__ import annotations

from pathlib import Path

import pytest

from uasfly.airframe import Airframe
from uasfly.airframe_file import Target, find_target
from uasfly.bench.airframe_file import write_recommendation
from uasfly.bench.recommend import Recommendation
from uasfly.errors import FileError
from uasfly.files import find_file, load_file, shipped_folder

TEXT = find_file("airframe", "f550").read_text(encoding="utf-8")


def _target(name: object) -> Target:
    return find_target(str(name), "--recommend")


FOUND = Recommendation(horizon_s=2.5, nodes=40, rate_hz=40.0, holds_hz=100.0, fits=True, why="")


def test_three_numbers_change_and_nothing_else(tmp_path: Path) -> None:
    """Comments, order and spaces stay; the result is an airframe."""
    file = tmp_path / "mine.yaml"
    file.write_text(TEXT.replace("  nodes: 25\n", "  nodes:   25   # nodes: of old\n"), encoding="utf-8")
    file.chmod(0o640)
    changes = write_recommendation(_target(file), FOUND)
    expected = TEXT.replace("  nodes: 25\n", "  nodes:   40   # nodes: of old\n")
    expected = expected.replace("rate_hz: 50.0", "rate_hz: 40.0").replace("horizon_s: 3.0", "horizon_s: 2.5")
    assert file.read_text(encoding="utf-8") == expected
    assert file.stat().st_mode & 0o777 == 0o640
    assert changes == [
        "controller.rate_hz: 50.0 -> 40.0",
        "controller.horizon_s: 3.0 -> 2.5",
        "controller.nodes: 25 -> 40",
    ]
    assert load_file(file, Airframe).controller.nodes == 40
    assert list(tmp_path.iterdir()) == [file]


def test_flow_style_and_windows_line_ends_stay(tmp_path: Path) -> None:
    """Fields on one line are told apart."""
    file = tmp_path / "mine.yaml"
    old = "  rate_hz: 50.0\n  horizon_s: 3.0\n  nodes: 25\n  first_interval_s: 0.02\n"
    assert old in TEXT
    start, _, weights = TEXT.partition("controller:")[2].partition("  weights:")
    block, rest = weights.split("\n\n", 1)
    fields = ", ".join(line.split("#")[0].strip() for line in block.splitlines()[1:])
    flow = (
        f"controller: {{ rate_hz: 50.0, horizon_s: 3.0, nodes: 25, first_interval_s: 0.02, weights: {{ {fields} }} }}"
    )
    assert start
    text = f"{TEXT.partition('controller:')[0]}{flow}\n\n{rest}".replace("\n", "\r\n")
    file.write_bytes(text.encode())
    write_recommendation(_target(file), FOUND)
    changed = "rate_hz: 40.0, horizon_s: 2.5, nodes: 40, first"
    assert file.read_bytes().decode() == text.replace("rate_hz: 50.0, horizon_s: 3.0, nodes: 25, first", changed)


def test_a_result_that_is_no_airframe_changes_nothing(tmp_path: Path) -> None:
    """160 nodes of 0.02 s do not fit into the horizon: the file stays, and nothing lies beside it."""
    file = tmp_path / "mine.yaml"
    file.write_text(TEXT, encoding="utf-8")
    with pytest.raises(FileError, match="first_interval_s"):
        write_recommendation(_target(file), Recommendation(3.0, 160, 50.0, holds_hz=50.0, fits=True, why=""))
    assert file.read_text(encoding="utf-8") == TEXT
    assert list(tmp_path.iterdir()) == [file]


def test_a_number_on_a_line_of_its_own_is_refused(tmp_path: Path) -> None:
    """It is YAML, but not changed blindly: the error says what to do."""
    file = tmp_path / "mine.yaml"
    file.write_text(TEXT.replace("nodes: 25", "nodes:\n    25"), encoding="utf-8")
    with pytest.raises(FileError, match="nodes"):
        write_recommendation(_target(file), FOUND)


def test_shipped_files_are_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By name or by path: the copy is written here, the shipped file stays as it is, and no file is overwritten."""
    monkeypatch.chdir(tmp_path)
    write_recommendation(_target("f550"), FOUND)
    assert load_file(tmp_path / "f550.yaml", Airframe).controller.nodes == 40
    assert find_file("airframe", "f550", [shipped_folder("airframe")]).exists()
    assert (shipped_folder("airframe") / "f550.yaml").read_text(encoding="utf-8") == TEXT
    with pytest.raises(FileError, match="there already"):
        _target(shipped_folder("airframe") / "f550.yaml")
    with pytest.raises(FileError, match="no such file"):
        _target("nothing")
