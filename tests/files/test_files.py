"""Files are found, read, changed by --set and checked, and every problem names its place."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from uasfly import files
from uasfly.airframe import Airframe
from uasfly.errors import FileError
from uasfly.files import find_file, load_file, parse_overrides, shipped_names, top_level_fields, write_schema
from uasfly.mission import CircleLeg, HoverLeg, Mission

MISSION = """\
name: test
takeoff: {height_m: 1.5}
legs:
  - type: hover
    position_m: [0, 0, 1.5]
    duration_s: 10
  - type: circle
    center_m: [0, 0]
    radius_m: 1
    height_m: 1.5
    speed_m_s: 0.5
"""


Writer = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Writer:
    """Writes a text to a file and gives its path."""

    def write_text(text: str) -> Path:
        path = tmp_path / "mission.yaml"
        path.write_text(text)
        return path

    return write_text


def problems(path: Path, overrides: list[str] | None = None, model: type = Mission) -> list[str]:
    """Problems of a file that cannot be loaded."""
    with pytest.raises(FileError) as caught:
        load_file(path, model, parse_overrides(overrides or []))
    assert caught.value.path == str(path)
    return caught.value.problems


def test_a_file_becomes_the_model(write: Writer) -> None:
    """Whole numbers are numbers, lists are tuples."""
    hover, circle = load_file(write(MISSION), Mission).legs
    assert isinstance(hover, HoverLeg)
    assert hover.position_m == (0.0, 0.0, 1.5)
    assert isinstance(circle, CircleLeg)
    assert circle.radius_m == 1.0


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("radius_m", "raduis_m", "line 9: legs[1].raduis_m is not a known field; did you mean radius_m?"),
        ("takeoff: {height_m: 1.5}", "takeoff: {}", "line 2: takeoff.height_m is missing; expected a number"),
        ("duration_s: 10", "duration_s: -1", "line 6: legs[0].duration_s: expected a number, above 0"),
        ("duration_s: 10", "duration_s: '10'", "found '10'"),
        ("duration_s: 10", "duration_s: true", "found true"),
        ("duration_s: 10", "duration_s: .nan", "found nan (not a finite number)"),
        ("duration_s: 10", "duration_s:", "line 6: legs[0].duration_s: expected a number"),
        ("[0, 0, 1.5]", "[0, 0]", "line 5: legs[0].position_m: expected a list of three numbers"),
        ("[0, 0, 1.5]", "[0, 0, 1, 1]", "found a list of 4"),
        ("[0, 0, 1.5]", "1.5", "found 1.5"),
        ("[0, 0, 1.5]", "[0, up, 1]", "line 5: legs[0].position_m[1]: expected a number"),
        ("type: circle", "type: cirlce", "line 7: legs[1].type: expected one of hover, back_and_forth, spiral, circle"),
        ("type: circle", "type: cirlce", "found 'cirlce'; did you mean circle?"),
        ("type: circle", "name: circle", "line 7: legs[1].type is missing; expected one of hover"),
        ("speed_m_s", "period_s: 9\n    speed_m_s", "line 7: legs[1]: expected either speed_m_s or period_s, but both"),
        ("name: test", "name: ''", "line 1: name: expected a text, not shorter than 1, found ''"),
        ("name: test", "name: [a]", "line 1: name: expected a text, not shorter than 1, found a list of 1"),
        (
            "name: test",
            "name: test\nending: {action: lnad}",
            "line 2: ending.action: expected one of land, hold, return",
        ),
        ("name: test", "name: test\nending: {action: lnad}", "found 'lnad'; did you mean land?"),
        ("name: test", "name: test\nlimits: 5", "line 2: limits: expected a block of fields, found 5"),
        ("name: test", "name: test\nyaw: {rule: facing}", "line 2: yaw.point_m is missing; expected a list of two"),
    ],
)
def test_a_problem_names_line_field_expectation_finding_and_mend(
    write: Writer, old: str, new: str, expected: str
) -> None:
    """What is wrong can be mended without opening the manual."""
    assert expected in "\n".join(problems(write(MISSION.replace(old, new))))


def test_all_problems_come_at_once_and_none_is_invented(write: Writer) -> None:
    """Two wrong legs are two problems; that no valid leg is left is not a third."""
    text = MISSION.replace("duration_s: 10", "duration_s: -1").replace("radius_m: 1", "radius_m: -1")
    assert [problem.split(":")[0] for problem in problems(write(text))] == ["line 6", "line 9"]


@pytest.mark.parametrize("text", ["- a\n- b", "just text", "null", "3"])
def test_a_file_that_is_no_mapping_says_what_it_is(write: Writer, text: str) -> None:
    """The outermost level holds fields."""
    assert "expected a mapping of fields" in problems(write(text))[0]


def test_files_that_cannot_be_read_say_why(tmp_path: Path) -> None:
    """Missing, a directory, a pipe, not UTF-8, too large."""
    assert problems(tmp_path / "none.yaml") == ["there is no such file"]
    assert "is a directory" in problems(tmp_path)[0]
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "no regular file" in problems(pipe)[0]
    latin = tmp_path / "latin.yaml"
    latin.write_bytes(b"name: x\ndescription: caf\xe9\n")
    assert problems(latin) == ["line 2: byte 0xe9 is not UTF-8; save the file as UTF-8 text"]
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * (files.MAX_BYTES + 1))
    assert "larger than" in problems(large)[0]


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    """Editors on Windows write one."""
    path = tmp_path / "mark.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + MISSION.encode())
    assert load_file(path, Mission).name == "test"


def test_set_changes_fields_items_and_sections_that_are_not_there(write: Writer) -> None:
    """Dotted names, list indices, YAML values."""
    flags = ["legs[0].position_m[2]=2", "legs[1].direction=clockwise", "limits.geofence.radius_m=7", "yaw={rule: path}"]
    mission = load_file(write(MISSION), Mission, parse_overrides(flags))
    hover, circle = mission.legs
    assert isinstance(hover, HoverLeg)
    assert hover.position_m == (0.0, 0.0, 2.0)
    assert isinstance(circle, CircleLeg)
    assert circle.direction == "clockwise"
    assert mission.limits.geofence is not None
    assert mission.limits.geofence.radius_m == 7.0
    assert mission.yaw.rule == "path"


@pytest.mark.parametrize(
    ("flag", "expected"),
    [
        ("legs[0].positon_m=1", "--set: legs[0].positon_m is not a known field; did you mean position_m?"),
        ("takeof.height_m=2", "--set: takeof is not a known field; did you mean takeoff?"),
        ("legs[0].position_m=3", "--set: legs[0].position_m: expected a list of three numbers"),
        ("limits.wind_m_s=99", "--set: limits.wind_m_s: expected a number, above 0 and not above 40, found 99"),
        ("legs[7].duration_s=3", "--set legs[7].duration_s: legs has 2 items, [0] to [1]; found index [7]"),
        ("legs.x=3", "--set legs.x: expected legs to be a block of fields, found a list of 2"),
        ("name.x=3", "--set name.x: expected name to be a block of fields, found 'test'"),
        ("takeoff[0]=3", "--set takeoff[0]: expected takeoff to be a list, found a block of fields"),
    ],
)
def test_a_wrong_set_is_refused_by_its_key(write: Writer, flag: str, expected: str) -> None:
    """The flag is named, not a line of the file that the user did not write."""
    (problem,) = problems(write(MISSION), [flag])
    assert problem.startswith(expected)


def test_a_scalar_does_not_silently_fill_a_triple() -> None:
    """model.drag_1_s=0.3 could mean three axes or a forgotten bracket: it is refused."""
    (problem,) = problems(find_file("airframe", "f550"), ["model.drag_1_s=0.3"], Airframe)
    assert "model.drag_1_s: expected a list of three numbers" in problem
    changed = load_file(find_file("airframe", "f550"), Airframe, parse_overrides(["model.drag_1_s=[0.3, 0.3, 0.3]"]))
    assert changed.model.drag_1_s == (0.3, 0.3, 0.3)


def test_a_rule_between_fields_names_both() -> None:
    """Limits that do not hold hover are refused with the figures."""
    (problem,) = problems(find_file("airframe", "f550"), ["limits.thrust_max=0.3"], Airframe)
    assert "hover thrust 0.344" in problem


@pytest.mark.parametrize("flag", ["x", "=3", "a..b=1", "a[b]=1", "legs[0]x=3", ".a=1", "a.=3", "a]=1", "[0]=1"])
def test_a_flag_without_a_readable_key_is_refused(flag: str) -> None:
    """The message shows how a key looks."""
    with pytest.raises(FileError, match=r"expected (key=value|names joined by dots)"):
        parse_overrides([flag])


def test_a_flag_with_a_value_that_is_no_yaml_is_refused() -> None:
    """The key is named, and the place in the value."""
    with pytest.raises(FileError, match=r"--set a: line 1, column 3: not valid YAML"):
        parse_overrides(["a=[1"])


def test_values_of_flags_are_yaml() -> None:
    """An empty value is nothing, as in a file; an equals sign may stand in a value."""
    overrides = parse_overrides(["a.b=25", "c=[1, 2]", "d=land", "e=", "f=x=y"])
    assert overrides == {"a.b": 25, "c": [1, 2], "d": "land", "e": None, "f": "x=y"}


def test_names_are_found_in_any_spelling_and_paths_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name may be written with dashes; a file of that name in the working directory wins."""
    monkeypatch.chdir(tmp_path)
    shipped = find_file("mission", "back_and_forth")
    assert find_file("mission", "back-and-forth") == find_file("mission", "Back-And-Forth") == shipped
    assert find_file("mission", "hover.yaml").name == "hover.yaml"
    (tmp_path / "hover.yaml").write_text(MISSION)
    (tmp_path / "spiral").mkdir()
    assert find_file("mission", "hover.yaml") == Path("hover.yaml")
    assert find_file("mission", "hover") != Path("hover.yaml")
    assert find_file("mission", "spiral").is_file()
    assert find_file("mission", str(tmp_path / "hover.yaml")) == tmp_path / "hover.yaml"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("f505", "there is no airframe of this name, and no such file; did you mean f550?"),
        ("zeppelin", "there is no airframe of this name, and no such file (shipped"),
        ("./f550.yaml", "there is no such file"),
        ("", "the name of the airframe is empty"),
        ("a\0b", "there is no airframe of this name"),
        ("x" * 5000, "there is no airframe of this name"),
        ("/", "it is a directory"),
    ],
)
def test_what_is_not_there_is_refused_with_the_names_there_are(name: str, expected: str) -> None:
    """Whatever was typed, the answer lists what could have been."""
    with pytest.raises(FileError) as caught:
        find_file("airframe", name)
    (problem,) = caught.value.problems
    assert problem.startswith(expected)
    assert "(shipped airframes: aurelia_x6, f550, iris, px4_sih)" in problem


def test_other_folders_can_be_searched_instead(tmp_path: Path) -> None:
    """The first folder that has the name gives the file."""
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        folder.mkdir()
        (folder / "both.yaml").touch()
    (second / "one.yml").touch()
    assert find_file("scenario", "both", [first, second]) == first / "both.yaml"
    assert find_file("scenario", "one", [first, second]) == second / "one.yml"


def test_an_installed_package_carries_its_files_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where uasfly/data exists, it is used; in a checkout the folders lie beside the package."""
    inside = tmp_path / "uasfly" / "data" / "missions"
    inside.mkdir(parents=True)
    (inside / "only.yaml").touch()
    (tmp_path / "airframes").mkdir()
    (tmp_path / "airframes" / "beside.yaml").touch()
    monkeypatch.setattr(files, "_PACKAGE", tmp_path / "uasfly")
    assert find_file("mission", "only") == inside / "only.yaml"
    assert shipped_names("airframe") == ["beside"]


def test_top_level_fields_tell_what_a_file_is(write: Writer) -> None:
    """Names only; nothing is checked."""
    assert top_level_fields(write(MISSION)) == {"name", "takeoff", "legs"}
    with pytest.raises(FileError, match="expected a mapping"):
        top_level_fields(write("- a"))


@pytest.mark.parametrize("model", [Mission, Airframe])
def test_a_schema_says_which_draft_it_is_and_refuses_unknown_fields(model: type[Mission | Airframe]) -> None:
    """Editors need both."""
    schema = write_schema(model)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["title"] == f"uasfly {model.__name__.lower()} file"
    assert schema["additionalProperties"] is False
    assert "name" in schema["required"]


def test_a_file_of_nothing_but_mistakes_names_the_first_of_them(write: Writer) -> None:
    """Looking for a like name takes its time, and nobody reads a thousand problems."""
    text = MISSION + "".join(f"raduis_{number}: 1\n" for number in range(3000))
    found = problems(write(text))
    assert found[0].startswith("line 12: raduis_0 is not a known field")
    assert len(found) == 31
    assert found[-1] == "and more than 30 problems in all; mend these first"


def test_an_error_cannot_reach_the_terminal(write: Writer) -> None:
    """What a file holds is shown with its escapes, not carried out."""
    (problem,) = problems(write(MISSION + '"\\e[2J\\u202e": 1\n'))
    assert "\\x1b[2J\\u202e is not a known field" in problem


@pytest.mark.parametrize("key", [f"legs[{'9' * 5000}]", "legs[1234567]", "legs[²]"])
def test_an_index_of_any_length_is_no_index(key: str) -> None:
    """Python refuses to read whole numbers of thousands of digits."""
    with pytest.raises(FileError, match="is not the path of a field") as caught:
        parse_overrides([f"{key}=1"])
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("value", ["1.0e-300", "5.0e-324", "0.00005"])
@pytest.mark.parametrize("field", ["duration_s: 10", "radius_m: 1", "speed_m_s: 0.5"])
def test_a_figure_too_small_to_fly_by_is_refused(write: Writer, field: str, value: str) -> None:
    """Its reciprocal overflows; it was a slip."""
    name = field.split(":", maxsplit=1)[0]
    (problem,) = problems(write(MISSION.replace(field, f"{name}: {value}")))
    assert "expected a number, above 0.0001" in problem


@pytest.mark.parametrize(
    "assignment", ["model.k_thrust_m_s2=1e200", "controller.weights.terminal=.inf", "mass_kg=1e300"]
)
def test_a_figure_too_large_to_reckon_with_is_refused(assignment: str) -> None:
    """Its square overflows; k_thrust_m_s2 did so in `uasfly check`."""
    with pytest.raises(FileError, match="not above"):
        load_file(find_file("airframe", "f550"), Airframe, parse_overrides([assignment]))
