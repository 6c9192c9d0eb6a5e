"""Odd values: numbers, texts and plain data that a person or a broken program might write."""

from __future__ import annotations

import math
from typing import TypeVar

from tests.fuzz.harness import Rng

T = TypeVar("T")

ODD_SCALARS = (
    *("0", "-0", "-1", "1", "1.5", "-1e-300", "1e-300", "1e300", "-1e300", "1e308", "1e999", "-1e999", "5e-324"),
    *(".nan", ".inf", "-.inf", ".NaN", "nan", "inf", "NULL", "~", "", "true", "False", "yes", "0x7fffffffffffffff"),
    *(
        "0o777",
        "0b11",
        "1_000",
        "1:30:00",
        "9" * 40,
        "9" * 299,
        "9" * 301,
        "1" + "0" * 5000,
        "+.5",
        "1.",
        ".5e+",
        "--1",
    ),
    *(
        "'text'",
        '"\\e[31mred\\0\\x7f"',
        '"\\ud800"',
        "'\u202e\u2066'",
        "\u0661\u0662",
        "\u00b2",
        "\U0001f681",
        "é" * 50,
    ),
    *("[]", "{}", "[[]]", "{a: {b: {c: 1}}}", "[1, 2]", "[1, 2, 3, 4]", "[.nan, .inf, 1]", "[1, two, 3]", "{1: 2}"),
    *(
        "!!python/object/apply:os.system [ls]",
        "!!binary aGk=",
        "!!float 1",
        "!x 1",
        "&a 1",
        "*a",
        "<<: *a",
        "2026-08-01",
    ),
    *("| \n text", "> \n folded", "? x", "- - - 1", "@at", "`tick`", "%TAG ! x", "--- 1", "... ", "# comment", ", ,"),
    *(
        "{x: 1, x: 2}",
        "[" * 40,
        "{a: " * 40,
        "x" * 70_000,
        '"' + "y" * 3000 + '"',
        "'" + "z" * 300 + "'",
        "land",
        "hover",
    ),
)
ODD_LINES = (
    *(
        "\tname: tab",
        "name: again",
        "? complex\n: value",
        "<<: {a: 1}",
        "- item",
        "...",
        "---",
        "%YAML 1.1",
        "&x",
        "*x",
    ),
    *(
        "a: &a [x,x]\nb: &b [*a,*a,*a]\nc: &c [*b,*b,*b]",
        "{",
        "}",
        "]",
        '"',
        "'",
        "| ",
        "\x00",
        "\ufeff",
        "\x85",
        "\u2028x: 1",
    ),
    *(
        "\rname: cr",
        "legs:",
        "legs: []",
        "faults: [{kind: gnss_lost}]",
        "? [a]\n: 1",
        "__class__: x",
        "model_config: {}",
    ),
    *(
        '"\\u0000": 1',
        '"\\e[2J": 1',
        "k" * 3000 + ": 1",
        "self: 1",
        "1: 2",
        "null: 3",
        "~: 4",
        "true: 5",
        "name:\u00a0x",
    ),
)


def choice(rng: Rng, options: tuple[T, ...] | list[T]) -> T:
    """One of several."""
    return options[int(rng.integers(len(options)))]


def odd_number(rng: Rng) -> float:
    """A finite number of any size, often at an edge."""
    kind = rng.integers(6)
    if kind == 0:
        return choice(rng, (0.0, -0.0, 1.0, -1.0, 1e-300, 5e-324, 1e300, -1e300, 1.7976931348623157e308, 1e154, 1e155))
    if kind == 1:
        return float(rng.integers(-1000, 1000))
    if kind == 2:
        return float(10.0 ** rng.uniform(-12.0, 12.0)) * choice(rng, (1.0, -1.0))
    if kind == 3:
        return float(10.0 ** rng.uniform(-300.0, 300.0)) * choice(rng, (1.0, -1.0))
    return float(rng.normal(0.0, 10.0))


def any_number(rng: Rng) -> float:
    """A number, at times no finite one."""
    return choice(rng, (math.nan, math.inf, -math.inf)) if rng.random() < 0.2 else odd_number(rng)


def odd_data(rng: Rng, depth: int = 0) -> object:
    """Plain data of any shape."""
    kind = rng.integers(10 if depth < 3 else 7)
    if kind < 2:
        return odd_number(rng)
    if kind == 2:
        return int(rng.integers(-(2**62), 2**62)) if rng.random() < 0.5 else choice(rng, (10**40, -(10**290), 2**31))
    if kind == 3:
        return choice(rng, (None, True, False, math.nan, math.inf, -math.inf))
    if kind < 7:
        return choice(
            rng, ("", "x", "land", "hover", "0", "1.5", "nan", "\x00\x1b[31m", "é\u202e", "y" * 500, "a b", "-")
        )
    if kind == 7:
        return [odd_data(rng, depth + 1) for _ in range(rng.integers(5))]
    if kind == 8:
        return [odd_data(rng, 3)] * int(rng.integers(1, 300))
    return {
        choice(rng, ("a", "name", "type", "kind", "x" * 200, "\x1b", "")): odd_data(rng, depth + 1) for _ in range(3)
    }
