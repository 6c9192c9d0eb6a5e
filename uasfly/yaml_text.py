"""YAML text to plain data, with the line of every value: the YAML 1.2 core schema and nothing beyond it.

Anchors, aliases, tags, directives and several documents in one file are refused: a mission needs none of them, and
without them a small file cannot grow into a large one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentEndEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

from uasfly.errors import FileError, shortened

DataPath = tuple[str | int, ...]

MAX_DEPTH = 32
MAX_DIGITS = 300

_BREAK = re.compile("[\n\r\x85\u2028\u2029]")  # what the reader counts as the end of a line
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"([-+]?)\.(?:inf|Inf|INF)")
_WORDS: Mapping[str, object] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}


_MENDS = (
    ("<stream end>", "a bracket, brace or quote before it is not closed"),
    ("end of stream", "a quote before it is not closed"),
    ("<block end>", "indent it like the lines that it belongs to"),
    ("<document start>", "it does not go on from what stands before it: look at indentation and brackets"),
    ("mapping values are not allowed", "indent it like the lines that it belongs to, or put the text in quotes"),
    ("could not find expected ':'", "expected a field and its value (name: value)"),
    ("cannot start any token", "put the text in quotes"),
    ("',' or", "put a comma between the items, or close the bracket"),
)


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data (mappings, lists, text, numbers, booleans, None) and where each part of it stands.

    Attributes:
        data: the document.
        lines: line (from 1) of every key, item and of the document itself, by its path.
    """

    data: object
    lines: Mapping[DataPath, int]

    def line(self, path: DataPath) -> int:
        """Line of a path, or of its nearest enclosing part that is in the text."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)


def dotted(path: DataPath) -> str:
    """A path as people write it: ("legs", 2, "radius_m") is "legs[2].radius_m"."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            name = shortened(part)
            text += f".{name}" if text else name
    return text


def parse_yaml(text: str, source: str) -> Document:
    """Parse one YAML document.

    Args:
        text: the document.
        source: what to call it in errors.

    Raises:
        FileError: syntax (with line and column), duplicate keys, anchors, aliases, tags, directives, nesting too deep,
            more than one document, or nothing at all.
    """
    try:
        return _Builder(source).build(YAML(typ="safe", pure=True).parse(text))
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        tab = mark is not None and "\t" in _BREAK.split(text[: mark.index + 1])[-1]
        mend = "; indent with spaces, not tabs" if tab else _mend(error.problem or "")
        context = f" {error.context}" if error.context else ""
        problem = f"{where}not valid YAML: {error.problem or 'cannot be read'}{context}{mend}"
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        problem = f"line {line}: character U+{ord(text[error.position]):04X} is not allowed in YAML; remove it"
    except YAMLError as error:
        problem = f"not valid YAML: {error}"
    raise FileError(source, [problem]) from None


def _mend(problem: str) -> str:
    """What mostly is to be done about a problem of the parser, which knows the grammar only."""
    for sign, mend in _MENDS:
        if sign in problem:
            return f"; {mend}"
    return ""


@dataclass(slots=True)
class _Open:
    """A mapping or list that is being read; `key` is the key whose value comes next."""

    path: DataPath
    value: dict[str, object] | list[object]
    key: str | None = None
    skip_value: bool = False


class _Builder:
    """Builds plain data from parser events; collects problems that do not stop the reading."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._problems: list[str] = []
        self._lines: dict[DataPath, int] = {}
        self._stack: list[_Open] = []
        self._root: object = None

    def build(self, events: Iterator[Event]) -> Document:
        documents = 0
        for event in events:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self._stop(event, "a second document begins here; expected one document a file (remove '---')")
                if event.version or event.tags:
                    self._stop(event, "a %-directive stands before the document; expected none (remove it)")
            elif isinstance(event, AliasEvent):
                self._stop(event, f"alias *{shortened(event.anchor)}: aliases are not used here; write the value out")
            elif isinstance(event, NodeEvent):
                self._node(event)
            elif isinstance(event, (MappingEndEvent, SequenceEndEvent)):
                self._stack.pop()
            elif isinstance(event, DocumentEndEvent) and () not in self._lines:
                self._lines[()] = 1
        if documents == 0:
            raise FileError(self._source, ["the file is empty; expected a mapping of fields"])
        if self._problems:
            raise FileError(self._source, self._problems)
        return Document(self._root, self._lines)

    def _stop(self, event: Event, text: str) -> None:
        raise FileError(self._source, [*self._problems, f"line {event.start_mark.line + 1}: {text}"])

    def _node(self, event: NodeEvent) -> None:
        if event.anchor is not None:
            self._stop(event, f"anchor &{shortened(event.anchor)}: anchors are not used here; write the value out")
        tag = getattr(event, "tag", None)
        if tag is not None:
            self._stop(event, f"tag {shortened(str(tag))}: tags are not used here; write the plain value")
        top = self._stack[-1] if self._stack else None
        if top is not None and isinstance(top.value, dict) and top.key is None:
            self._key(event, top, top.value)
            return
        path = self._place(event, top)
        value = self._value(event, path)
        if top is None:
            self._root = value
        elif isinstance(top.value, list):
            top.value.append(value)
        elif top.key is not None:
            if not top.skip_value:
                top.value[top.key] = value
            top.key, top.skip_value = None, False

    def _place(self, event: NodeEvent, top: _Open | None) -> DataPath:
        if top is None:
            path: DataPath = ()
        elif isinstance(top.value, list):
            path = (*top.path, len(top.value))
        else:
            path = (*top.path, top.key or "")
        self._lines.setdefault(path, event.start_mark.line + 1)
        return path

    def _value(self, event: NodeEvent, path: DataPath) -> object:
        if isinstance(event, ScalarEvent):
            return self._scalar(event) if event.implicit[0] else event.value
        if len(self._stack) >= MAX_DEPTH:
            self._stop(event, f"nested deeper than {MAX_DEPTH} levels; expected a plain file")
        value: dict[str, object] | list[object] = [] if isinstance(event, SequenceStartEvent) else {}
        self._stack.append(_Open(path, value))
        return value

    def _key(self, event: NodeEvent, top: _Open, mapping: dict[str, object]) -> None:
        if isinstance(event, (MappingStartEvent, SequenceStartEvent)) or not isinstance(event, ScalarEvent):
            self._stop(event, "a list or mapping is used as a key; expected a field's name")
            return
        line = event.start_mark.line + 1
        path = (*top.path, event.value)
        if event.value in mapping:
            first = self._lines[path]
            self._problems.append(f"line {line}: {dotted(path)} appears twice (first in line {first}); remove one")
            top.skip_value = True
        self._lines.setdefault(path, line)
        top.key = event.value

    def _scalar(self, event: ScalarEvent) -> object:
        text: str = event.value
        if text in _WORDS:
            return _WORDS[text]
        if match := _INFINITY.fullmatch(text):
            return float(match[1] + "inf")
        if _INTEGER.fullmatch(text) or _FLOAT.fullmatch(text):
            if len(text) > MAX_DIGITS:
                self._stop(event, f"a number of {len(text)} characters; expected at most {MAX_DIGITS}")
            if text.startswith(("0o", "0x")):
                return int(text, 0)
            return int(text) if _INTEGER.fullmatch(text) else float(text)
        return text
