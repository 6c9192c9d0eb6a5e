"""`uasfly reproduce` as it is typed; what the papers' experiments give is tested elsewhere."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from uasfly.cli.main import app
from uasfly.errors import FileError, UasflyError
from uasfly.reproduce import papers
from uasfly.reproduce.rows import Progress, Reproduction, Row

ROWS = (
    Row("hover", "position RMS", "m", 0.4, 0.25, True),
    Row("hover", "ratio [of two]", "", None, 1.25, None, "paper: above 1"),
    Row("line", "position RMS", "m", 0.1, 0.2, False, "worse"),
)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Nothing is flown; what would have been is kept."""
    kept: list[tuple[str, int]] = []

    def reproduce(name: str, seed: int, progress: Progress) -> Reproduction:
        kept.append((name, seed))
        progress("hover", 0.5)

        def draw(path: Path) -> None:
            path.write_bytes(b"drawn")

        return Reproduction(name, ROWS, {"hover": draw} if name else {})

    monkeypatch.setattr(papers, "reproduce", reproduce)
    return kept


def test_json_is_a_list_of_rows_and_nothing_else(asked: list[tuple[str, int]]) -> None:
    """Objects with the row's names; true, false or null; nothing beside them on standard output."""
    result = CliRunner().invoke(app, ["reproduce", "asignacion2022", "--json", "--seed", "7"])
    assert result.exit_code == 0
    rows = json.loads(result.stdout)
    assert [list(row) for row in rows] == [["experiment", "quantity", "unit", "paper", "uasfly", "better", "note"]] * 3
    assert [row["better"] for row in rows] == [True, None, False]
    assert rows[1]["paper"] is None
    assert asked == [("asignacion2022", 7)]


def test_the_table_has_every_row(asked: list[tuple[str, int]]) -> None:
    """Figures of the paper and of uasfly, units and notes."""
    result = CliRunner().invoke(app, ["reproduce", "asignacion2022"], env={"COLUMNS": "160"})
    assert result.exit_code == 0
    for text in ("position RMS [m]", "ratio [of two]", "0.25", "0.4", "paper: above 1", "worse"):
        assert text in result.stdout


def test_a_folder_gets_rows_and_pictures(asked: list[tuple[str, int]], tmp_path: Path) -> None:
    """Each in a file that begins with the paper's name; without the flag nothing is drawn."""
    folder = tmp_path / "some" / "where"
    result = CliRunner().invoke(app, ["reproduce", "asignacion2022", "--json", "--out", str(folder)])
    assert result.exit_code == 0
    assert (folder / "asignacion2022_hover.png").read_bytes() == b"drawn"
    written = json.loads((folder / "asignacion2022.json").read_text(encoding="utf-8"))
    assert written == json.loads(result.stdout)
    assert "asignacion2022_hover.png" in result.stderr


def test_a_paper_that_is_not_there_is_refused(asked: list[tuple[str, int]]) -> None:
    """The message lists those that are."""
    result = CliRunner().invoke(app, ["reproduce", "newton1687"])
    assert isinstance(result.exception, UasflyError)
    assert "expected one of asignacion2022" in str(result.exception)
    assert asked == []


def test_a_folder_that_cannot_be_made_is_refused_before_anything_flies(
    asked: list[tuple[str, int]], tmp_path: Path
) -> None:
    """A file stands in its way."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    result = CliRunner().invoke(app, ["reproduce", "asignacion2022", "--out", str(tmp_path / "file" / "folder")])
    assert isinstance(result.exception, FileError)
    assert asked == []


def test_without_matplotlib_a_folder_is_refused_before_anything_flies(
    asked: list[tuple[str, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message says what to install."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = CliRunner().invoke(app, ["reproduce", "asignacion2022", "--out", str(tmp_path)])
    assert isinstance(result.exception, UasflyError)
    assert "uasfly[campaign]" in str(result.exception)
    assert asked == []


def test_every_paper_that_is_offered_is_there() -> None:
    """Its module can be imported and has what the table promises."""
    import importlib

    for name in papers.PAPERS:
        assert callable(importlib.import_module(f"uasfly.reproduce.{name}").reproduce)


def test_the_command_line_starts_without_the_experiments() -> None:
    """What flies them is loaded when a paper is asked for, and so are NumPy and SciPy."""
    script = "import sys, uasfly.cli.main; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert "uasfly.reproduce.papers" in loaded
    assert not {"uasfly.reproduce.asignacion2022", "uasfly.wind", "scipy", "matplotlib"} & set(loaded)
