"""Damages texts of files: bytes, lines, indentation, values, syntax."""

from __future__ import annotations

import re
from collections.abc import Callable

from tests.fuzz.harness import Rng
from tests.fuzz.odd import ODD_LINES, ODD_SCALARS, any_number, choice

LARGEST = 100_000
_VALUE = re.compile(r"(?<=: )[^\n#{\[]+|(?<=[\[,] )[^\n,\]}]+|-?\d+\.?\d*")
_NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
_KEY = re.compile(r"\b[a-z_0-9]{1,60}(?=:)")
_BREAKS = ("\r", "\r\n", "\x85", "\u2028", "\u2029", "\x0c", "\x0b", "\n\n")

Mutation = Callable[[Rng, str], str]


def damaged(rng: Rng, text: str, others: tuple[str, ...]) -> bytes:
    """A text with one to a few damages, as the bytes of a file."""
    for _ in range(1 + int(rng.geometric(0.6))):
        text = _spliced(rng, text, others) if rng.random() < 0.05 else choice(rng, _MUTATIONS)(rng, text)
        text = text[:LARGEST]
    raw = text.encode("utf-8", "surrogatepass")
    return _with_other_bytes(rng, raw) if rng.random() < 0.15 else raw


def _with_other_bytes(rng: Rng, raw: bytes) -> bytes:
    content = bytearray(raw)
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(len(content) + 1))
        kind = rng.integers(4)
        if kind == 0 and at < len(content):
            content[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            content[at:at] = rng.bytes(int(rng.integers(1, 5)))
        elif kind == 2:
            del content[at : at + int(rng.integers(1, 20))]
        else:
            content[at:at] = choice(
                rng, (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc0\x80", b"\xed\xa0\x80", b"\x1b[2J")
            )
    return bytes(content)


def _lines(change: Callable[[Rng, list[str]], None]) -> Mutation:
    def mutation(rng: Rng, text: str) -> str:
        lines = text.split("\n")
        change(rng, lines)
        return "\n".join(lines)

    return mutation


def _drop(rng: Rng, lines: list[str]) -> None:
    at = int(rng.integers(len(lines)))
    del lines[at : at + int(rng.integers(1, 4))]
    if not lines:
        lines.append("")


def _duplicate(rng: Rng, lines: list[str]) -> None:
    at = int(rng.integers(len(lines)))
    part = lines[at : at + int(rng.integers(1, 5))]
    lines[at:at] = part * (int(rng.integers(2, 200)) if rng.random() < 0.1 else 1)


def _swap(rng: Rng, lines: list[str]) -> None:
    a, b = int(rng.integers(len(lines))), int(rng.integers(len(lines)))
    lines[a], lines[b] = lines[b], lines[a]


def _indent(rng: Rng, lines: list[str]) -> None:
    at = int(rng.integers(len(lines)))
    lines[at] = choice(rng, (" ", "  ", "    ", "\t", " \t", "\u00a0", "- ", "")) + lines[at].lstrip(
        choice(rng, (" ", ""))
    )


def _insert(rng: Rng, lines: list[str]) -> None:
    lines.insert(int(rng.integers(len(lines) + 1)), " " * int(rng.integers(0, 6)) + choice(rng, ODD_LINES))


def _replace(pattern: re.Pattern[str], make: Callable[[Rng, str], str]) -> Mutation:
    def mutation(rng: Rng, text: str) -> str:
        places = list(pattern.finditer(text))
        if not places:
            return text + make(rng, "")
        place = choice(rng, places)
        return text[: place.start()] + make(rng, place.group()) + text[place.end() :]

    return mutation


def _other_number(rng: Rng, number: str) -> str:
    kind = rng.integers(4)
    if kind == 0:
        return f"-{number}"
    if kind == 1:
        return f"{number}e{rng.integers(-400, 400)}"
    if kind == 2:
        return f"{any_number(rng)!r}"
    return f"{10.0 ** rng.uniform(-6, 6):.6g}"


def _misspelled(rng: Rng, key: str) -> str:
    letters = list(key) or ["x"]
    letters[int(rng.integers(len(letters)))] = choice(rng, ("", "x", "_", "é", " ", "\x1b", ":"))
    return "".join(letters)


def _character(rng: Rng, text: str) -> str:
    at = int(rng.integers(len(text) + 1))
    extra = choice(rng, tuple("{}[],:#&*!|>'\"%@`?-\t\\\x00\x07\x1b\x7f\x85\u2028\ufeff\ufffe\ud800\u202e"))
    return text[:at] + extra * (1 + int(rng.geometric(0.7))) + text[at + int(rng.integers(2)) :]


def _truncated(rng: Rng, text: str) -> str:
    return text[: int(rng.integers(len(text) + 1))]


def _other_breaks(rng: Rng, text: str) -> str:
    other = choice(rng, _BREAKS)
    if rng.random() < 0.5:
        return text.replace("\n", other)
    at = text.find("\n", int(rng.integers(len(text) + 1)))
    return text if at < 0 else text[:at] + other + text[at + 1 :]


def _deep(rng: Rng, text: str) -> str:
    depth = choice(rng, (5, 31, 32, 33, 200, 3000))
    nested = choice(rng, ("[", "{a: ", "- ", "? ", "[{a: ", "a:\n ")) * depth + "1"
    at = int(rng.integers(len(text) + 1))
    return text[:at] + nested + text[at:]


def _spliced(rng: Rng, text: str, others: tuple[str, ...]) -> str:
    lines, other = text.split("\n"), choice(rng, others).split("\n")
    at, cut = int(rng.integers(len(lines) + 1)), int(rng.integers(len(other)))
    return "\n".join((*lines[:at], *other[cut : cut + int(rng.integers(1, 12))], *lines[at:]))


_MUTATIONS: tuple[Mutation, ...] = (
    _lines(_drop),
    _lines(_duplicate),
    _lines(_swap),
    _lines(_indent),
    _lines(_insert),
    _replace(_VALUE, lambda rng, _: choice(rng, ODD_SCALARS)),
    _replace(_VALUE, lambda rng, _: choice(rng, ODD_SCALARS)),
    _replace(_NUMBER, _other_number),
    _replace(_NUMBER, _other_number),
    _replace(_NUMBER, _other_number),
    _replace(_KEY, _misspelled),
    _character,
    _truncated,
    _other_breaks,
    _deep,
)
