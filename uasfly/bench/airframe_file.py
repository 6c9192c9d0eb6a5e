"""Writes recommended settings into an airframe file: three numbers change, everything else stays as it stands there."""

from __future__ import annotations

import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

from uasfly.airframe import Airframe
from uasfly.bench.recommend import Recommendation
from uasfly.errors import FileError
from uasfly.files import is_file, load_file, shipped_folder, shipped_names
from uasfly.yaml_text import parse_yaml

SECTION = "controller"


@dataclass(frozen=True, slots=True)
class Target:
    """Where to write: `source` is read, `path` is written; they differ where a shipped file is copied."""

    source: Path
    path: Path


def find_target(name: str) -> Target:
    """The file to change, or the copy to make: shipped files stay as they are, `NAME.yaml` is written here instead.

    Raises:
        FileError: there is no such file, it is no airframe, it may not be written, or the copy's name is taken.
    """
    shipped = shipped_folder("airframe").resolve()
    path = Path(name)
    if not is_file(path):
        if name not in shipped_names("airframe"):
            raise FileError(name, ["--recommend: there is no such file; expected an airframe file or a shipped name"])
        target = Target(shipped / f"{name}.yaml", Path(f"{name}.yaml"))
    elif path.resolve().parent == shipped:
        target = Target(path, Path(path.name))
    else:
        target = Target(path, path)
    if target.source is not target.path and target.path.exists():
        problem = f"--recommend: shipped files stay as they are, and {target.path} is there already; name that file"
        raise FileError(name, [problem])
    load_file(target.source, Airframe)
    if not os.access(target.path.absolute().parent, os.W_OK):
        raise FileError(str(target.path), ["--recommend: this folder may not be written to"])
    return target


def write_recommendation(target: Target, recommendation: Recommendation) -> list[str]:
    """Change the file in one step, and tell what has changed, a line each; nothing where nothing has.

    Raises:
        FileError: a field stands in the file in a way that cannot be changed in place, or the result is no airframe.
    """
    with target.source.open(encoding="utf-8", newline="") as stream:
        text = stream.read()
    before = load_file(target.source, Airframe).controller
    changes = []
    for field in ("rate_hz", "horizon_s", "nodes"):
        old, new = getattr(before, field), getattr(recommendation, field)
        if old != new:
            text = _with_value(text, field, new, str(target.source))
            changes.append(f"{SECTION}.{field}: {old} -> {new}")
    if changes or target.source is not target.path:
        _write(text, target.path)
    return changes


def _with_value(text: str, field: str, value: float, source: str) -> str:
    """The text with another number behind a field of the section; comments and spaces stay."""
    line = parse_yaml(text, source).line((SECTION, field))
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


def _write(text: str, path: Path) -> None:
    """Check a text as an airframe beside its place, then move it there."""
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=".yaml", dir=path.absolute().parent)
    beside = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        load_file(beside, Airframe)
        beside.chmod(path.stat().st_mode & 0o777 if path.exists() else 0o644)
        beside.replace(path)
    except OSError as error:
        raise FileError(str(path), [f"it cannot be written: {error.strerror or error}"]) from error
    finally:
        beside.unlink(missing_ok=True)
