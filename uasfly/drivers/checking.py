"""Checks files without flying, and refuses missions that the airframe cannot fly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from uasfly.airframe import Airframe
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import FileError, UasflyError, printable
from uasfly.files import Kind, find_file, is_directory, is_file, load_file, top_level_fields, write_schema
from uasfly.mission import Mission
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.trajectories.feasibility import check_airframe, check_mission

MODELS: dict[Kind, type[Any]] = {
    "mission": Mission,
    "airframe": Airframe,
    "scenario": Scenario,
    "plant": Plant,
    "camera": Camera,
    "bundle": Bundle,
}
_NAMES = "mission, airframe, scenario, plant, camera or bundle"
_ANY = "a mission, an airframe, a scenario, a plant, a camera or a bundle"
# Fields that only one kind of file has: they tell what a file is meant to be.
_SIGNS: dict[Kind, set[str]] = {
    "mission": {"legs", "takeoff", "ending", "transition"},
    "airframe": {"controller", "observer", "yaw_pid", "backup"},
    "scenario": {"wind", "sensors", "link"},
    "plant": {"inertia_kg_m2", "battery", "rotors"},
    "camera": {"fx", "fy", "cx", "cy", "width_px", "height_px", "transform_camera_to_body"},
    "bundle": {"markers", "family"},
}


@dataclass(frozen=True, slots=True)
class CheckFinding:
    """One thing that a check has to say about a file."""

    file: str
    severity: Literal["ok", "warning", "error"]
    message: str

    def text(self) -> str:
        """One line for people."""
        file = printable(self.file)
        return f"{file}: {self.severity}: {self.message}" if self.severity != "ok" else f"{file}: ok"

    def as_dict(self) -> dict[str, str]:
        """For scripts."""
        return {"file": self.file, "severity": self.severity, "message": self.message}


def check_files(files: list[str], airframe_name: str) -> list[CheckFinding]:
    """Check each file; missions are held against the airframe.

    Raises:
        FileError: when the airframe to hold missions against cannot be used.
    """
    airframe: Airframe | None = None
    findings: list[CheckFinding] = []
    for name in files:
        try:
            path, kind = _locate(name)
            loaded = load_file(path, MODELS[kind], {})
        except FileError as error:
            findings += [CheckFinding(error.path, "error", problem) for problem in error.problems]
            continue
        found: list[CheckFinding] = []
        if isinstance(loaded, Mission):
            if airframe is None:
                airframe = load_file(find_file("airframe", airframe_name), Airframe)
            found = [
                CheckFinding(str(path), finding.severity, f"{finding.field}: {finding.text}")
                for finding in check_mission(loaded, airframe)
            ]
        elif isinstance(loaded, Airframe):
            found = [
                CheckFinding(str(path), finding.severity, f"{finding.field}: {finding.text}")
                for finding in check_airframe(loaded)
            ]
        findings += found or [CheckFinding(str(path), "ok", f"a {kind}")]
    return findings


def refuse_infeasible(mission: Mission, airframe: Airframe, say: Callable[[str], None]) -> None:
    """Say what a mission asks beyond the airframe; errors stop it.

    Raises:
        UasflyError: when the airframe cannot fly the mission.
    """
    findings = check_mission(mission, airframe)
    for finding in findings:
        if finding.severity == "warning":
            say(f"warning: {finding.field}: {finding.text}")
    errors = [f"{finding.field}: {finding.text}" for finding in findings if finding.severity == "error"]
    if errors:
        raise UasflyError(f"mission {mission.name} is not for airframe {airframe.name}:\n" + "\n".join(errors))


def schema_of(kind: str) -> dict[str, Any]:
    """JSON Schema of a kind of file.

    Raises:
        UasflyError: for a kind that does not exist.
    """
    for name, model in MODELS.items():
        if kind == name:
            return write_schema(model)
    raise UasflyError(f"schema: expected one of {', '.join(MODELS)}, found {kind!r}")


def _locate(name: str) -> tuple[Path, Kind]:
    """Where a file is and what kind it is meant to be: by its fields, or by the folder that ships the name."""
    if Path(name).suffix in (".yaml", ".yml") or is_file(Path(name)):
        path = Path(name)
        fields = top_level_fields(path)
        kind = max(_SIGNS, key=lambda candidate: len(_SIGNS[candidate] & fields))
        if not _SIGNS[kind] & fields:
            raise FileError(name, [f"expected {_ANY}, found fields of none"])
        return path, kind
    for candidate in MODELS:
        try:
            return find_file(candidate, name), candidate
        except FileError:
            continue
    if is_directory(Path(name)):
        raise FileError(name, ["it is a directory; expected a file"])
    raise FileError(name, [f"no such file, and no {_NAMES} of this name is shipped"])
