"""`uasfly bench` as it is typed; what it measures is tested elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from uasfly.bench import bench as module
from uasfly.bench.bench import BenchResult, BenchSettings
from uasfly.bench.recommend import Recommendation
from uasfly.cli.main import app
from uasfly.errors import UasflyError

FOUND = Recommendation(horizon_s=3.0, nodes=40, rate_hz=40.0, holds_hz=50.0, fits=True, why="made up")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[BenchSettings]:
    """Nothing is measured; what would have been is kept."""
    kept: list[BenchSettings] = []

    def run_bench(settings: BenchSettings, told: object, *, solver_only: bool = False) -> BenchResult:
        kept.append(settings)
        return BenchResult(recommended=None if solver_only else FOUND)

    monkeypatch.setattr(module, "run_bench", run_bench)
    return kept


@pytest.mark.parametrize(
    "flags",
    [
        ("--nodes", "30,x"),
        ("--airframe", "nothing"),
        ("--recommend", "nothing"),
        ("--recommend", "f550", "--airframe", "iris"),
        ("--recommend", "f550", "--solver-only"),
    ],
)
def test_wrong_flags_are_refused_before_anything_is_measured(
    flags: tuple[str, ...], asked: list[BenchSettings]
) -> None:
    """Each with a message of its own, which `main` turns into exit code 2."""
    result = CliRunner().invoke(app, ["bench", *flags])
    assert isinstance(result.exception, UasflyError)
    assert flags[0] in str(result.exception) or flags[1] in str(result.exception)
    assert asked == []


def test_one_json_object_on_standard_output(asked: list[BenchSettings]) -> None:
    """Whatever else there is to say goes to standard error."""
    result = CliRunner().invoke(app, ["bench", "--json", "--nodes", "30,60", "--backend", "c", "--quick"])
    assert json.loads(result.stdout)["recommended"]["nodes"] == 40
    assert (asked[0].sizes, asked[0].backends, asked[0].quick) == ((30, 60), ("c",), True)


def test_recommended_settings_are_written(
    asked: list[BenchSettings], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that is changed is the one that is measured; what has changed is told."""
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["bench", "--recommend", "iris", "--json"])
    assert result.exit_code == 0
    assert asked[0].airframe.name == "iris"
    assert "nodes: 40" in (tmp_path / "iris.yaml").read_text(encoding="utf-8")
    assert "iris.yaml: controller.rate_hz" in result.stderr
    assert json.loads(result.stdout)["recommended"]["rate_hz"] == 40.0
