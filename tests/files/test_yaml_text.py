"""YAML text becomes plain data with lines, or an error with its place."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uasfly.errors import FileError
from uasfly.yaml_text import dotted, parse_yaml


def problems(text: str) -> list[str]:
    """Problems of a text that cannot be parsed."""
    with pytest.raises(FileError) as caught:
        parse_yaml(text, "f.yaml")
    return caught.value.problems


def test_scalars_follow_the_yaml_1_2_core_schema() -> None:
    """Words of YAML 1.1 (no, on, octal 010, dates, underscores) are not turned into something else."""
    data = parse_yaml(
        "[1, -2, 010, 0x1F, 0o17, 1e3, .5, 1., null, ~, true, False, no, on, 2020-01-01, 1_000, '3', \"true\"]", "f"
    ).data
    expected = [1, -2, 10, 31, 15, 1000.0, 0.5, 1.0, None, None, True, False]
    assert data == [*expected, "no", "on", "2020-01-01", "1_000", "3", "true"]


def test_infinity_and_not_a_number_are_numbers() -> None:
    """The special floats of YAML arrive as such, so that the checks behind can refuse them by name."""
    numbers = parse_yaml("[.inf, -.Inf, .nan]", "f").data
    assert isinstance(numbers, list)
    infinite, negative, undefined = numbers
    assert infinite == math.inf
    assert negative == -math.inf
    assert math.isnan(undefined)


def test_every_key_and_item_has_its_line() -> None:
    """Lines count from 1; a path that is not in the text gets the line of what encloses it."""
    document = parse_yaml("# comment\na: 1\nb:\n  - x: 1\n    y: 2\n  -\n    x: 3\n", "f")
    assert document.line(("a",)) == 2
    assert document.line(("b", 0, "y")) == 5
    assert document.line(("b", 1, "x")) == 7
    assert document.line(("b", 0, "missing")) == 4
    assert document.line(("missing",)) == document.line(()) == 2


def test_duplicate_keys_are_all_reported_with_both_lines() -> None:
    """Neither value silently wins."""
    found = problems("a: 1\nb: {c: 1, c: 2}\na: 3\n")
    assert found == [
        "line 2: b.c appears twice (first in line 2); remove one",
        "line 3: a appears twice (first in line 1); remove one",
    ]


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("a: [1,\nb: 2", "line 2, column 5", "not valid YAML"),
        ("a: 1\n b: 2", "line 2, column 3", "mapping values"),
        ("a:\n\t- b", "line 2, column 1", "not tabs"),
        ("a: 'open", "line 1", "not valid YAML"),
        ("a: 1\nb: \x07", "line 2", "U+0007"),
        ("a: &x 1\nb: *x", "line 1", "anchor &x"),
        ("b: *x", "line 1", "alias *x"),
        ("a: !!python/object:os.system x", "line 1", "tag"),
        ("%YAML 1.1\n---\na: 1", "line 2", "%-directive"),
        ("a: 1\n---\nb: 2", "line 2", "second document"),
        ("? [a, b]\n: c", "line 1", "used as a key"),
        ("a: " + "9" * 400, "line 1", "a number of 400 characters"),
        ("a: " + "[" * 100, "line 1", "nested deeper"),
    ],
)
def test_what_no_file_needs_is_refused_with_its_place(text: str, where: str, what: str) -> None:
    """Syntax errors, and the features of YAML that make files grow or run code."""
    (problem,) = problems(text)
    assert problem.startswith(where)
    assert what in problem


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n"])
def test_an_empty_file_says_so(text: str) -> None:
    """Nothing in it is not the same as a wrong field."""
    assert problems(text) == ["the file is empty; expected a mapping of fields"]


def test_an_alias_bomb_is_refused_at_its_first_anchor() -> None:
    """Nine lines that would grow to a billion items never do."""
    lines = ["a0: &a0 [x, x]"] + [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    assert problems("\n".join(lines)) == ["line 1: anchor &a0: anchors are not used here; write the value out"]


@given(st.text(alphabet="ab:-?[]{},#&*!|>'\"%@` \n\t0.\\\x00\x85\ud7ffé", max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_text_gives_data_or_a_file_error(text: str) -> None:
    """No text makes the reader fail in another way."""
    try:
        parse_yaml(text, "f")
    except FileError as error:
        assert error.problems


def test_paths_are_written_as_people_write_them() -> None:
    """Names are joined by dots, indices stand in brackets."""
    assert dotted(("legs", 2, "points", 0, "position_m")) == "legs[2].points[0].position_m"


@pytest.mark.parametrize("line_break", ["\x85", "\u2028", "\u2029", "\r"])
def test_a_problem_behind_an_odd_line_break_has_its_place(line_break: str) -> None:
    """The reader may count more lines than there are line feeds; looking for tabs in the last must not fail."""
    (problem,) = problems(f"a: 1{line_break * 3}b: [1, 2")
    assert problem.startswith("line 4, column 9" if line_break == "\r" else "line 1, column 9")


@pytest.mark.parametrize(
    ("text", "mend"),
    [
        ("a: b: c\n", "indent it like the lines"),
        ("a:\n  - 1\n b: 2\n", "indent it like the lines"),
        ("a: {b: 1\n", "is not closed"),
        ("a: 'b\n", "is not closed"),
        ("a: @b\n", "put the text in quotes"),
        ("- a\nb: 1\n", "indent it like the lines"),
    ],
)
def test_wrong_syntax_says_how_to_mend_it(text: str, mend: str) -> None:
    """The parser names its grammar; a person wants to know what to do."""
    (problem,) = problems(text)
    assert mend in problem


def test_names_of_any_length_are_shown_by_their_beginning() -> None:
    """A key, a tag or an anchor may be as long as the file."""
    assert dotted(("x" * 5000, 1)) == "x" * 57 + "...[1]"
    assert dotted(("x\ny",)) == "x\\ny"
    for text in (f"&{'a' * 5000} b", f"!{'t' * 5000} b", f"*{'a' * 5000}"):
        assert len(problems(text)[0]) < 300
