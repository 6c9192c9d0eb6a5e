"""An identified drag, written into an airframe file."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.identify.test_drag import write_drag_log
from uasfly.airframe import Airframe
from uasfly.airframe_file import Target, find_target
from uasfly.cli.main import main
from uasfly.errors import FileError
from uasfly.files import find_file, load_file, shipped_folder
from uasfly.identify.airframe_section import section_line, write_drag
from uasfly.identify.drag import IdentifiedDrag

TEXT = find_file("airframe", "f550").read_text(encoding="utf-8")
SHIPPED = "wind: { drag_1_s: 0.2281, drag_1_m: 0.01684, drag_sigma_share: 0.02 } # identified"
FOUND = IdentifiedDrag(0.20004, 0.0150001, np.eye(2), 0.0312, np.zeros((1, 2)), 0.1, 9.0, 500)
LINE = "wind: { drag_1_s: 0.2, drag_1_m: 0.015, drag_sigma_share: 0.031 }"


def _target(path: Path) -> Target:
    return find_target(str(path), "--write")


def test_the_numbers_of_a_section_change_and_nothing_else(tmp_path: Path) -> None:
    """Comments, order and the section's other field stay, on one line or on several; twice is once."""
    assert section_line(FOUND) == LINE
    assert SHIPPED in TEXT
    block = "wind: # mine\n  tilt_sigma_rad: 0.004\n  drag_1_m: 0.01684 # old\n  drag_sigma_share: 0.02\n"
    block += "  drag_1_s: 0.2281 # identified"
    new_block = block.replace("0.01684", "0.015").replace("0.02\n", "0.031\n").replace("0.2281", "0.2")
    for old, new in ((SHIPPED, f"{LINE} # identified"), (block, new_block)):
        file = tmp_path / "mine.yaml"
        file.write_text(TEXT.replace(SHIPPED, old), encoding="utf-8")
        assert write_drag(_target(file), FOUND) == [
            "wind.drag_1_s: 0.2281 -> 0.2",
            "wind.drag_1_m: 0.01684 -> 0.015",
            "wind.drag_sigma_share: 0.02 -> 0.031",
        ]
        assert file.read_text(encoding="utf-8") == TEXT.replace(SHIPPED, new)
        assert write_drag(_target(file), FOUND) == []
    wind = load_file(file, Airframe).wind
    assert wind is not None
    assert (wind.drag_1_s, wind.drag_1_m, wind.drag_sigma_share, wind.tilt_sigma_rad) == (0.2, 0.015, 0.031, 0.004)


def test_through_a_link_the_file_behind_it_is_written(tmp_path: Path) -> None:
    """The link stays."""
    (tmp_path / "fleet").mkdir()
    file, link = tmp_path / "fleet" / "f550_3.yaml", tmp_path / "mine.yaml"
    file.write_text(TEXT, encoding="utf-8")
    link.symlink_to(file)
    write_drag(_target(link), FOUND)
    assert link.is_symlink()
    assert file.read_text(encoding="utf-8") == TEXT.replace(SHIPPED, f"{LINE} # identified")


@pytest.mark.parametrize(("cut", "ending"), [(0, "\n"), (1, "\n"), (0, "\r\n")])
def test_a_file_without_the_section_gets_it_at_its_end(tmp_path: Path, cut: int, ending: str) -> None:
    """Behind an empty line, with the file's line ends, whether its last line has one or not."""
    file = tmp_path / "mine.yaml"
    before = TEXT.partition("\nwind:")[0].replace("\n", ending)
    file.write_bytes(before[: len(before) - cut * len(ending)].encode())
    assert write_drag(_target(file), FOUND) == [LINE]
    assert file.read_bytes().decode() == f"{before}{ending}{LINE}{ending}"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("wind:", "without anything in it"),
        ("wind: {drag_1_m: 0.1, drag_sigma_share: 0.1, drag_1_s:\n 0.3}", "drag_1_s"),
    ],
)
def test_a_section_that_cannot_be_changed_in_place_is_refused(tmp_path: Path, section: str, words: str) -> None:
    """With its line; the file stays as it is."""
    file = tmp_path / "mine.yaml"
    text = TEXT.replace(SHIPPED, f"{section} # identified")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=rf"mine\.yaml: line \d+: .*{words}"):
        write_drag(_target(file), FOUND)
    assert file.read_text(encoding="utf-8") == text
    assert list(tmp_path.iterdir()) == [file]


def test_of_a_shipped_airframe_a_copy_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the working directory, with the drag; the shipped file stays as it is."""
    monkeypatch.chdir(tmp_path)
    write_drag(find_target("f550", "--write"), FOUND)
    assert (tmp_path / "f550.yaml").read_text(encoding="utf-8") == TEXT.replace(SHIPPED, f"{LINE} # identified")
    assert (shipped_folder("airframe") / "f550.yaml").read_text(encoding="utf-8") == TEXT
    with pytest.raises(FileError, match="--write: there is no such file"):
        find_target("nothing", "--write")


def test_the_command_writes_what_it_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """JSON stays alone on standard output; a folder that takes no files ends with a message and exit code 2."""
    log = tmp_path / "flight.mcap"
    write_drag_log(log)
    monkeypatch.setattr(sys, "argv", ["uasfly", "identify", "drag", str(log), "--json", "--write", "f550"])

    def outcome(folder: Path) -> tuple[object, str, str]:
        monkeypatch.chdir(folder)
        with pytest.raises(SystemExit) as done:
            main()
        return done.value.code, *capsys.readouterr()

    code, printed, told = outcome(tmp_path)
    assert code == 0
    wind = load_file(tmp_path / "f550.yaml", Airframe).wind
    assert wind is not None
    assert wind.drag_1_s == round(json.loads(printed)["drag_1_s"], 4)
    assert told.startswith("f550.yaml: wind.drag_1_s: 0.2281 -> 0.")
    code, _, told = outcome(Path("/proc"))  # which takes none from root either
    assert code == 2
    assert told.startswith("uasfly: f550.yaml: ")
    assert "written" in told
