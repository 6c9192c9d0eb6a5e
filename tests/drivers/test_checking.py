"""Checks without flying: each file for what it is, missions against an airframe, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from uasfly.airframe import Airframe
from uasfly.drivers.checking import MODELS, CheckFinding, check_files, refuse_infeasible, schema_of
from uasfly.errors import FileError, UasflyError
from uasfly.files import Kind, find_file, load_file, shipped_names
from uasfly.mission import Mission
from uasfly.trajectories.feasibility import hover_wind_limit_m_s

GOOD = """\
name: there
takeoff: {height_m: 1.5}
legs:
  - {type: line, to_m: [2, 0, 1.5], speed_m_s: 0.5}
"""
TOO_FAST = GOOD.replace("[2, 0, 1.5], speed_m_s: 0.5", "[90, 0, 1.5], speed_m_s: 25")
WRONG = GOOD.replace("height_m: 1.5", "height_m: high").replace("type: line", "type: lime")


def _write(folder: Path, text: str, name: str = "mission.yaml") -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("kind", list(MODELS))
def test_every_shipped_file_is_taken_for_what_it_is_and_has_no_error(kind: Kind) -> None:
    """Found by path: the kind is told from the fields alone."""
    for name in shipped_names(kind):
        path = str(find_file(kind, name))
        findings = check_files([path], "f550")
        assert findings, path
        assert "error" not in {finding.severity for finding in findings}, findings
        if findings[0].severity == "ok":
            assert findings == [CheckFinding(path, "ok", f"a {kind}")]


def test_a_shipped_name_is_enough() -> None:
    """Names are looked up among missions, airframes, scenarios and plants, in this order."""
    mission, airframe, scenario = check_files(["hover", "px4_sih", "gusty"], "f550")
    assert mission.file == str(find_file("mission", "hover"))
    assert airframe.file == str(find_file("airframe", "px4_sih"))
    assert scenario.message == "a scenario"


def test_a_folder_of_the_same_name_is_in_nobodys_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A working directory with a folder `hover` still has the mission of this name."""
    (tmp_path / "hover").mkdir()
    monkeypatch.chdir(tmp_path)
    (finding,) = check_files(["hover"], "f550")
    assert finding.file == str(find_file("mission", "hover"))


def test_every_problem_of_every_file_is_found(tmp_path: Path) -> None:
    """One wrong file does not hide the next; each problem has line and field."""
    good, wrong = _write(tmp_path, GOOD), _write(tmp_path, WRONG, "wrong.yaml")
    findings = check_files([wrong, "nowhere.yaml", "nothing", good], "f550")
    by_file: dict[str, list[CheckFinding]] = {}
    for finding in findings:
        by_file.setdefault(finding.file, []).append(finding)
    assert {finding.severity for finding in by_file[wrong]} == {"error"}
    texts = " ".join(finding.message for finding in by_file[wrong])
    assert "line 2" in texts
    assert "takeoff.height_m" in texts
    assert "line 4" in texts
    assert "legs[0]" in texts
    assert "no such file" in by_file["nowhere.yaml"][0].message
    assert "no such file, and no mission, airframe, scenario, plant, camera or bundle" in by_file["nothing"][0].message
    assert by_file[good] == [CheckFinding(good, "ok", "a mission")]


def test_a_file_of_no_kind_is_told_what_was_expected(tmp_path: Path) -> None:
    """A YAML file with other fields is not guessed to be a mission."""
    path = _write(tmp_path, "colour: red\n")
    (finding,) = check_files([path], "f550")
    assert finding.severity == "error"
    assert "expected a mission, an airframe, a scenario, a plant, a camera or a bundle" in finding.message


def test_missions_are_held_against_the_airframe(tmp_path: Path) -> None:
    """25 m/s is more than the f550 flies: an error at the leg."""
    path = _write(tmp_path, TOO_FAST)
    errors = [finding for finding in check_files([path], "f550") if finding.severity == "error"]
    assert errors
    assert all("legs[0]" in finding.message for finding in errors)


def test_the_airframe_is_needed_for_missions_only(tmp_path: Path) -> None:
    """An airframe that does not exist spoils the check of a mission, not that of a scenario."""
    assert [finding.severity for finding in check_files(["gusty"], "nothing")] == ["ok"]
    with pytest.raises(FileError, match="there is no airframe of this name"):
        check_files([_write(tmp_path, GOOD)], "nothing")


def test_findings_read_as_lines_and_as_data() -> None:
    """One line for people, three fields for scripts."""
    error = CheckFinding("a.yaml", "error", "line 3: legs[0]: too fast")
    assert error.text() == "a.yaml: error: line 3: legs[0]: too fast"
    assert error.as_dict() == {"file": "a.yaml", "severity": "error", "message": "line 3: legs[0]: too fast"}
    assert CheckFinding("a.yaml", "ok", "a mission").text() == "a.yaml: ok"


def test_a_mission_beyond_the_airframe_is_refused(tmp_path: Path) -> None:
    """Nothing flies; the error names mission, airframe and every leg that is too much."""
    mission = load_file(Path(_write(tmp_path, TOO_FAST)), Mission)
    airframe = load_file(find_file("airframe", "f550"), Airframe)
    with pytest.raises(UasflyError, match=r"mission there is not for airframe f550:\nlegs\[0\]"):
        refuse_infeasible(mission, airframe, lambda _: None)


def test_what_is_merely_unwise_is_said_and_flown(tmp_path: Path) -> None:
    """A warning goes to `say`; the mission is not refused. A mission well inside the limits says nothing."""
    airframe = load_file(find_file("airframe", "f550"), Airframe)
    strong = 0.85 * hover_wind_limit_m_s(airframe)
    airframe = airframe.model_copy(update={"limits": airframe.limits.model_copy(update={"wind_m_s": strong})})
    said: list[str] = []
    for wind_m_s, severities in ((1.0, set[str]()), (strong, {"warning"})):
        path = _write(tmp_path, f"{GOOD}limits: {{wind_m_s: {wind_m_s}}}\n")
        said.clear()
        refuse_infeasible(load_file(Path(path), Mission), airframe, said.append)
        assert {text.partition(":")[0] for text in said} == severities


@pytest.mark.parametrize("kind", list(MODELS))
def test_each_kind_has_a_schema_of_its_own_fields(kind: str) -> None:
    """The schema comes from the model that checks the files."""
    schema = schema_of(kind)
    assert set(schema["properties"]) >= set(MODELS[kind].model_fields)  # type: ignore[index]


def test_an_unknown_kind_has_no_schema() -> None:
    """The error lists the kinds."""
    with pytest.raises(
        UasflyError, match="expected one of mission, airframe, scenario, plant, camera, bundle, found 'aeroplane'"
    ):
        schema_of("aeroplane")


@pytest.mark.parametrize(
    ("name", "said"), [("x" * 5000, "no such file"), ("a\x00b", "no such file"), ("/", "directory")]
)
def test_a_name_that_no_file_can_have_is_told(name: str, said: str) -> None:
    """The system refuses to look for some names at all."""
    (finding,) = check_files([name], "f550")
    assert finding.severity == "error"
    assert said in finding.message


def test_a_finding_cannot_reach_the_terminal() -> None:
    """The name of a file is shown with its escapes."""
    assert check_files(["\x1b[2J"], "f550")[0].text().startswith("\\x1b[2J: error")
