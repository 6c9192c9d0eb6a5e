"""Finds, reads and checks the files people write (airframes, missions, plants, scenarios, cameras, bundles).

Every problem names line, field, what was expected and what was found; `--set` values are checked the same way.
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ValidationError

from uasfly.errors import FileError, shortened
from uasfly.file_problems import describe_problems, found, nearest
from uasfly.yaml_text import DataPath, Document, dotted, parse_yaml

M = TypeVar("M", bound=BaseModel)
Kind = Literal["airframe", "mission", "scenario", "plant", "camera", "bundle"]

MAX_BYTES = 96 * 1024  # the YAML reader takes a second for this much; a thousand waypoints need half of it
SUFFIXES = (".yaml", ".yml")
_PACKAGE = Path(__file__).parent
_PATH_PART = re.compile(r"\.?([^.\[\]]+)|\[([0-9]{1,6})\]")
_NO_OVERRIDES: Mapping[str, object] = MappingProxyType({})


def load_file(path: Path, model: type[M], overrides: Mapping[str, object] = _NO_OVERRIDES) -> M:
    """Read a YAML file, change what `overrides` says, and check the result.

    Args:
        path: the file.
        model: what it must be.
        overrides: values by dotted path ("limits.tilt_deg", "legs[0].radius_m"), as `parse_overrides` gives them.

    Raises:
        FileError: the file cannot be read, is no YAML, or is not what the model describes; it carries every problem.
    """
    return FileText(path).checked(model, overrides)


class FileText:
    """A YAML file that is read once and then checked as often as there are overrides to try."""

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            FileError: the file cannot be read or is no YAML mapping.
        """
        self.path = path
        self._data, self._document = _read_mapping(path)

    def checked(self, model: type[M], overrides: Mapping[str, object] = _NO_OVERRIDES) -> M:
        """What is in the file with some values changed, see `load_file`.

        Raises:
            FileError: it is not what the model describes; the error carries every problem.
        """
        data = copy.deepcopy(self._data)
        paths = _apply_overrides(data, self._document.lines, overrides, str(self.path))
        try:
            # JSON mode is strict about types (no "1.8" or true for a number) and still takes lists for tuples.
            return model.model_validate_json(json.dumps(data), strict=True)
        except ValidationError as error:
            where = _Where(self._document, paths)
            raise FileError(str(self.path), describe_problems(error, model, where)) from None

    def line(self, *path: str | int) -> int:
        """Line of a field, or of the nearest block around it that is in the file."""
        return self._document.line(path)


def top_level_fields(path: Path) -> set[str]:
    """Names of the outermost fields of a YAML file, which tell what kind of file it is.

    Raises:
        FileError: the file cannot be read or is no YAML mapping.
    """
    return set(_read_mapping(path)[0])


def find_file(kind: Kind, name: str, folders: Sequence[Path] | None = None) -> Path:
    """Find a file by its path or by its name.

    Args:
        kind: what is looked for; gives the shipped folder and the words of the error.
        name: a path ("my/f550.yaml"), or a name ("f550", "back-and-forth"), which is looked up in the working directory
            first and then in the folders.
        folders: where names are looked up; the shipped folder of that kind when not given.

    Raises:
        FileError: there is no such file; it lists the names there are.
    """
    plain = bool(name) and "/" not in name and "\\" not in name
    if name and is_file(Path(name)):
        return Path(name)
    shelves = list(folders) if folders is not None else [shipped_folder(kind)]
    shipped = {file.stem: file for shelf in reversed(shelves) for file in _yaml_files(shelf)}
    key = Path(name).stem if name.endswith(SUFFIXES) else name
    if plain:
        match = shipped.get(key) or shipped.get(key.strip().lower().replace("-", "_").replace(" ", "_"))
        if match:
            return match
    names = sorted(shipped)
    if not name:
        problem = f"the name of the {kind} is empty"
    elif plain:
        match_name = nearest(key, names)
        problem = f"there is no {kind} of this name, and no such file"
        problem += f"; did you mean {match_name}?" if match_name else ""
    else:
        problem = "it is a directory; expected a file" if is_directory(Path(name)) else "there is no such file"
    raise FileError(name or "''", [f"{problem} (shipped {kind}s: {', '.join(names) or 'none'})"])


def shipped_folder(kind: Kind) -> Path:
    """Folder of the files that come with uasfly: in the package, or beside it in a checkout."""
    if kind in ("scenario", "plant"):
        return _PACKAGE / "sim" / f"{kind}s"
    installed = _PACKAGE / "data" / f"{kind}s"
    return installed if installed.is_dir() else _PACKAGE.parent / f"{kind}s"


def shipped_names(kind: Kind) -> list[str]:
    """Names of the shipped files of a kind, sorted."""
    return sorted(file.stem for file in _yaml_files(shipped_folder(kind)))


def parse_overrides(assignments: Sequence[str]) -> dict[str, object]:
    """Values of `--set key=value` flags; values are YAML ("25", "[0.3, 0.3, 0.3]", "land").

    Raises:
        FileError: a flag without "=", with an empty or unreadable key, or with a value that is no YAML.
    """
    overrides: dict[str, object] = {}
    for assignment in assignments:
        key, equals, value = assignment.partition("=")
        key = key.strip()
        if not equals or not key:
            raise FileError("--set", [f"expected key=value (limits.tilt_deg=25), found {found(assignment)}"])
        split_key(key)
        source = f"--set {shortened(key)}"
        overrides[key] = parse_yaml(value, source).data if value.strip() else None
    return overrides


def split_key(key: str) -> DataPath:
    """The path of a field as `--set` names it: "legs[0].radius_m" is ("legs", 0, "radius_m").

    Raises:
        FileError: it is none.
    """
    path: list[str | int] = []
    position = 0
    while position < len(key):
        match = _PATH_PART.match(key, position)
        if match is None or (position == 0) == key.startswith((".", "["), position):
            expected = "expected names joined by dots, list indices in brackets (legs[0].radius_m)"
            raise FileError("--set", [f"{shortened(key)} is not the path of a field; {expected}"])
        name, index = match.groups()
        path.append(name if index is None else int(index))
        position = match.end()
    return tuple(path)


def write_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a file, for editors that check YAML while it is written."""
    schema = model.model_json_schema(mode="validation")
    title = schema.pop("title", model.__name__)
    draft = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": draft, "title": f"uasfly {title.lower()} file", **schema}


def _read_mapping(path: Path) -> tuple[dict[str, object], Document]:
    document = parse_yaml(_read_text(path), str(path))
    if not isinstance(document.data, dict):
        problem = f"line {document.line(())}: expected a mapping of fields (name: value), found {found(document.data)}"
        raise FileError(str(path), [problem])
    return document.data, document


def _read_text(path: Path) -> str:
    source = str(path)
    try:
        if path.is_dir():
            raise FileError(source, ["it is a directory; expected a YAML file"])
        if path.exists() and not path.is_file():
            raise FileError(source, ["it is no regular file; expected a YAML file"])
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise FileError(source, ["there is no such file"]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FileError(source, [f"it cannot be read: {reason}"]) from None
    if len(raw) > MAX_BYTES:
        raise FileError(source, [f"it is larger than {MAX_BYTES // 1024} kB; expected a file that a person wrote"])
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        problem = f"line {line}: byte 0x{raw[error.start]:02x} is not UTF-8; save the file as UTF-8 text"
        raise FileError(source, [problem]) from None


def _apply_overrides(
    data: dict[str, object], lines: Mapping[DataPath, int], overrides: Mapping[str, object], source: str
) -> set[DataPath]:
    """Put the values in; sections that are not in the file are made. Gives the changed paths."""
    changed: set[DataPath] = set()
    for key, value in overrides.items():
        path = split_key(key)
        place: object = data
        for depth, part in enumerate(path):
            last = depth == len(path) - 1
            if isinstance(place, dict) and isinstance(part, str):
                if last:
                    place[part] = value
                elif place.get(part) is None:
                    place[part] = {}
                place = place[part]
            elif isinstance(place, list) and isinstance(part, int) and part < len(place):
                if last:
                    place[part] = value
                place = place[part]
            else:
                raise FileError(source, [f"--set {shortened(key)}: {_misfit(path[:depth], part, place)}"])
        made = {path[:depth] for depth in range(1, len(path)) if path[:depth] not in lines}
        changed |= made | {path}
    return changed


def _misfit(path: DataPath, part: str | int, place: object) -> str:
    name = dotted(path) or "the file"
    if isinstance(part, int) and isinstance(place, list):
        return f"{name} has {len(place)} items, [0] to [{len(place) - 1}]; found index [{part}]"
    wanted = "a list" if isinstance(part, int) else "a block of fields"
    return f"expected {name} to be {wanted}, found {found(place)}"


class _Where:
    """Text in front of a problem: the flag that set the field, or its line."""

    def __init__(self, document: Document, changed: set[DataPath]) -> None:
        self._document = document
        self._changed = changed

    def __call__(self, path: DataPath) -> str:
        if any(path[:length] in self._changed for length in range(1, len(path) + 1)):
            return "--set: "
        return f"line {self._document.line(path)}: "


def _yaml_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.glob("*") if file.suffix in SUFFIXES and file.is_file())


def is_file(path: Path) -> bool:
    """Whether there is a file; False for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_directory(path: Path) -> bool:
    """Whether there is a directory; False for a name that none can have."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False
