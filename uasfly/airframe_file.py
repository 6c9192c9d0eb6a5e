"""Changes numbers in an airframe file; everything else stays as it stands there: comments, order, spaces, line ends."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from uasfly.airframe import Airframe
from uasfly.errors import FileError
from uasfly.file_writing import write_checked
from uasfly.files import is_file, load_file, shipped_folder, shipped_names
from uasfly.yaml_text import parse_yaml


@dataclass(frozen=True, slots=True)
class Target:
    """Where to write: `source` is read, `path` is written; they differ where a shipped file is copied."""

    source: Path
    path: Path


def find_target(name: str, option: str) -> Target:
    """The file to change, or the copy to make: shipped files stay as they are, `NAME.yaml` is written here instead.

    Args:
        name: a file, or a shipped airframe.
        option: the option that named it, for errors: "--write".

    Raises:
        FileError: there is no such file, it is no airframe, it may not be written, or the copy's name is taken.
    """
    shipped = shipped_folder("airframe").resolve()
    path = Path(name)
    if not is_file(path):
        if name not in shipped_names("airframe"):
            raise FileError(name, [f"{option}: there is no such file; expected an airframe file or a shipped name"])
        target = Target(shipped / f"{name}.yaml", Path(f"{name}.yaml"))
    elif path.resolve().parent == shipped:
        target = Target(path, Path(path.name))
    else:
        target = Target(path, path)
    if target.source is not target.path and target.path.exists():
        problem = f"{option}: shipped files stay as they are, and {target.path} is there already; name that file"
        raise FileError(name, [problem])
    load_file(target.source, Airframe)
    if not os.access(target.path.absolute().parent, os.W_OK):
        raise FileError(str(target.path), [f"{option}: this folder may not be written to"])
    return target


def read_target(target: Target) -> tuple[str, Airframe]:
    """The source's text, with its own line ends, and the airframe it describes."""
    with target.source.open(encoding="utf-8", newline="") as stream:
        return stream.read(), load_file(target.source, Airframe)


def write_numbers(target: Target, section: str, numbers: Mapping[str, tuple[float, float]]) -> list[str]:
    """Change fields of a section in one step, and tell what has changed, a line each; nothing where nothing has.

    Args:
        target: the file.
        section: its name; it is in the file.
        numbers: by field, what is there and what shall be.

    Raises:
        FileError: a field stands in the file in a way that cannot be changed in place, or the result is no airframe.
    """
    text, _ = read_target(target)
    changes = []
    for field, (old, new) in numbers.items():
        if old != new:
            text = _with_value(text, section, field, new, str(target.source))
            changes.append(f"{section}.{field}: {old} -> {new}")
    if changes or target.source is not target.path:
        write_checked(target.path, text, Airframe)
    return changes


def _with_value(text: str, section: str, field: str, value: float, source: str) -> str:
    """The text with another number behind a field of the section; comments and spaces stay."""
    line = parse_yaml(text, source).line((section, field))
    lines = text.splitlines(keepends=True)
    changed, count = re.subn(
        rf"(?<![\w-])({field}[\"']?\s*:\s+)[\w.+-]+", rf"\g<1>{value}", lines[line - 1].split("#")[0]
    )
    comment = lines[line - 1].partition("#")[1:]
    if count != 1:
        problem = f"line {line}: expected {field} and its number here, as in {field}: {value}; write it so, or set it"
        raise FileError(source, [f"{problem} yourself"])
    lines[line - 1] = changed + "".join(comment)
    return "".join(lines)
