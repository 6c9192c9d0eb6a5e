"""Files, flags and fault lines: whatever is in them loads or is refused with an error that says why."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from tests.fuzz import structures, texts
from tests.fuzz.harness import FindingError, Rng, unclear
from tests.fuzz.odd import ODD_SCALARS, choice
from tests.fuzz.structures import SchemaMaker
from uasfly.airframe import Airframe
from uasfly.drivers.checking import MODELS, check_files
from uasfly.drivers.plan import load_plan
from uasfly.errors import FileError, UasflyError
from uasfly.files import Kind, find_file, load_file, parse_overrides, shipped_names
from uasfly.link.urls import parse_url
from uasfly.mission import Mission
from uasfly.sim.fault_lines import FaultLines
from uasfly.sim.faults import Fault
from uasfly.sim.mavlink.endpoint import Endpoint
from uasfly.sim.mavlink.identity import Identity
from uasfly.sim.plant import Plant
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle
from uasfly.trajectories.feasibility import check_airframe, check_mission
from uasfly.yaml_text import parse_yaml

KINDS: tuple[Kind, ...] = ("mission", "airframe", "scenario", "plant")
SIMULATED_S = 0.2
READ_AT_ONCE = 4096  # as `uasfly sim` reads its standard input
FAULT_LINES = (
    "{kind: gnss_lost, duration_s: 20}",
    '{"kind": "wind", "velocity_m_s": [3, 0, 0], "ramp_s": 0.5}',
    "{kind: motor, motor: 2, effectiveness: 0.5}",
    "{kind: odometry_nan, part: all}",
    "kind: reboot",
)


@dataclass(frozen=True, slots=True)
class Shelf:
    """The shipped files of a kind, as texts, as data and as models."""

    texts: tuple[str, ...]
    data: tuple[Any, ...]
    models: tuple[Any, ...]
    maker: SchemaMaker


@cache
def shelf(kind: Kind) -> Shelf:
    """What is shipped of a kind; scenarios get some faults, which no shipped one has."""
    contents = [find_file(kind, name).read_text() for name in shipped_names(kind)]
    if kind == "scenario":
        faults = "\nfaults:\n" + "".join(f"  - {line}\n" for line in FAULT_LINES[:-1])
        contents += [text + faults for text in contents]
    return Shelf(
        tuple(contents),
        tuple(parse_yaml(text, kind).data for text in contents),
        tuple(load_file(find_file(kind, name), MODELS[kind]) for name in shipped_names(kind)),
        SchemaMaker(MODELS[kind]),
    )


class FileSession:
    """Files of one kind: half damaged texts, half data that mostly fits the schema."""

    def __init__(self, kind: Kind, rng: Rng) -> None:
        self._kind = kind
        self._shelf = shelf(kind)
        self._others = tuple(text for other in KINDS for text in shelf(other).texts)
        handle, name = tempfile.mkstemp(suffix=".yaml", prefix="fuzz_")
        os.close(handle)
        self._path = Path(name)

    def feed(self, rng: Rng) -> bool:
        """One file: read as `uasfly check` does it, and what loads is put to use."""
        self._path.write_bytes(self._content(rng))
        if rng.random() < 0.1:
            return self._through_the_command(rng)
        model = load_file(self._path, MODELS[self._kind])
        self._use(rng, model)
        return True

    def close(self) -> None:
        """Remove the file."""
        self._path.unlink(missing_ok=True)

    def _content(self, rng: Rng) -> bytes:
        number = int(rng.integers(len(self._shelf.texts)))
        kind = rng.random()
        if kind < 0.5:
            return texts.damaged(rng, self._shelf.texts[number], self._others)
        if kind < 0.55:
            return structures.as_yaml(self._shelf.maker.make(rng, self._shelf.maker.schema)).encode()
        data = structures.changed(rng, self._shelf.data[number], self._shelf.maker, damage=0.15)
        return structures.as_yaml(data).encode()

    def _through_the_command(self, rng: Rng) -> bool:
        return _check([str(self._path)], choice(rng, shipped_names("airframe")))

    def _use(self, rng: Rng, model: Any) -> None:
        if isinstance(model, Mission):
            findings = check_mission(model, choice(rng, shelf("airframe").models))
            _check_texts([f"{finding.field}: {finding.text}" for finding in findings])
        elif isinstance(model, Airframe):
            findings = check_airframe(model)
            findings += check_mission(choice(rng, shelf("mission").models), model) if rng.random() < 0.3 else []
            _check_texts([f"{finding.field}: {finding.text}" for finding in findings])
        elif rng.random() < 0.3:
            plant = model if isinstance(model, Plant) else choice(rng, shelf("plant").models)
            simulate(plant, model if isinstance(model, Scenario) else choice(rng, shelf("scenario").models), rng)


def _check(names: list[str], airframe: str) -> bool:
    """`uasfly check` as a program calls it; whether there is no error."""
    findings = check_files(names, airframe)
    if not findings:
        raise FindingError("a check says nothing at all")
    for finding in findings:
        if not finding.text().replace("\n", " ").isprintable() or unclear(FileError("check", [finding.message])):
            raise FindingError(f"a finding that cannot be printed: {finding.text()!r}")
    return all(finding.severity != "error" for finding in findings)


def _check_texts(problems: list[str]) -> None:
    if problems and (problem := unclear(FileError("check", problems))):
        raise FindingError(problem)


def simulate(plant: Plant, scenario: Scenario, rng: Rng) -> None:
    """Let a vehicle live for a moment, and take off where it may; its state must stay finite."""
    vehicle = SimulatedVehicle(plant, scenario, int(rng.integers(1000)))
    vehicle.advance_to(SIMULATED_S)
    truth, odometry = vehicle.truth(), vehicle.odometry()
    state = (*truth.position_in_world, *truth.velocity_in_world, *truth.quaternion_body_to_world, *truth.wind_in_world)
    if not np.isfinite(state).all():
        raise FindingError(f"the simulated state is not finite: {truth}")
    vehicle.battery()
    vehicle.health()
    if not scenario.faults and not np.isfinite(odometry.position_in_world).all():
        raise FindingError(f"the simulated estimate is not finite: {odometry}")


class FlagSession:
    """`--set` texts and connection URLs."""

    def __init__(self, rng: Rng) -> None:
        del rng

    def feed(self, rng: Rng) -> bool:
        """One text."""
        if rng.random() < 0.3:
            parse_url(self._url(rng))
            return True
        if rng.random() < 0.2:
            _check([self._name(rng)], "f550")
            return False
        assignment = self._assignment(rng)
        if rng.random() < 0.5:
            kind = choice(rng, KINDS)
            overrides = parse_overrides([assignment])
            name = choice(rng, shipped_names(kind))
            load_file(find_file(kind, name), MODELS[kind], overrides)
        else:
            load_plan("hover", "f550", scenario=choice(rng, (None, "calm")), settings=[assignment])
        return True

    def close(self) -> None:
        """Nothing to do."""

    def _assignment(self, rng: Rng) -> str:
        kind = choice(rng, KINDS)
        data = choice(rng, shelf(kind).data)
        path = choice(rng, structures.places(data)[1:])
        key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")
        key = choice(rng, (key, f"{kind}.{key}", f"{kind}.{key}.x", f"{kind}.{key}[0]", f"{key}[{'9' * 5000}]"))
        schema = shelf(kind).maker.schema_at(path, data)
        if schema is not None and rng.random() < 0.5:
            value = structures.as_yaml(shelf(kind).maker.make(rng, schema))
        else:
            value = choice(rng, ODD_SCALARS)
        text = f"{key}={value}"
        if rng.random() < 0.4:
            text = texts.damaged(rng, text, ("a=1", "[0]=2", "..=3")).decode(errors="replace")
        return text

    def _name(self, rng: Rng) -> str:
        base = choice(
            rng, ("hover", "missions/hover.yaml", "f550.yaml", "../x", "x" * 5000, "/dev/null", "/", ".", "a\x00b")
        )
        return base if rng.random() < 0.3 else texts.damaged(rng, base, ("/etc/", "\x1b.yml")).decode(errors="replace")

    def _url(self, rng: Rng) -> str:
        base = choice(
            rng,
            (
                *(
                    "udp://:14540",
                    "udpin://0.0.0.0:14540",
                    "udpout://192.168.1.10:14580",
                    "tcpout://host:5760",
                    "udp:14540",
                ),
                *("serial:///dev/ttyACM0:921600", "/dev/ttyUSB0:57600", "serial:/dev/ttyACM0", "tcp://[::1]:5760"),
                *("udp://1:²", "serial:///dev/x:²", f"udp://h:{'9' * 5000}", "udp://h:٣", "udp://" + "h" * 5000 + ":1"),
            ),
        )
        return base if rng.random() < 0.2 else texts.damaged(rng, base, ("udp://", ":@/")).decode(errors="replace")


class FaultLineSession:
    """Bytes on the standard input of a simulated vehicle, and what comes of the faults that they name."""

    def __init__(self, rng: Rng) -> None:
        self._vehicle = SimulatedVehicle(shelf("plant").models[0], Scenario(name="fuzz"), int(rng.integers(1000)))
        self._faults: list[Fault] = []
        self._complaints: list[str] = []
        self._lines = FaultLines(self._faults.append, self._complaints.append)
        self._maker = SchemaMaker(Scenario)
        vehicle = self._vehicle
        self._endpoint = Endpoint(vehicle, Identity(1), lambda: vehicle.time_s, lambda: 1.8e9)
        self._packer = dialect.MAVLink(None, 1, 1)

    def feed(self, rng: Rng) -> bool:
        """Some bytes; faults that come of them are injected into a vehicle that lives on."""
        self._faults.clear()
        self._complaints.clear()
        self._lines.feed(self._content(rng)[:READ_AT_ONCE] + b"\n")
        for complaint in self._complaints:
            if problem := unclear(UasflyError(complaint)):
                raise FindingError(problem)
        for fault in self._faults:
            self._vehicle.inject(fault)
        self._vehicle.advance_to(self._vehicle.time_s + 0.08)
        for message in self._endpoint.poll():
            message.pack(self._packer)
        truth = self._vehicle.truth()
        if not np.isfinite((*truth.position_in_world, *truth.velocity_in_world)).all():
            raise FindingError(f"the simulated state is not finite: {truth}")
        return bool(self._faults)

    def close(self) -> None:
        """A good line is taken after all that."""
        self._faults.clear()
        self._lines.feed(b"\n{kind: gnss_lost}\n")
        if len(self._faults) != 1:
            raise FindingError("a good line is not taken any more")

    def _content(self, rng: Rng) -> bytes:
        if rng.random() < 0.4:
            item = self._maker.schema["properties"]["faults"]["items"]
            made = self._maker.make(rng, item)
            made = structures.changed(rng, made, self._maker, damage=0.3) if rng.random() < 0.3 else made
            return structures.as_yaml(made).encode()
        return texts.damaged(rng, choice(rng, FAULT_LINES), FAULT_LINES)
