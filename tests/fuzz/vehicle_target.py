"""Datagrams into the simulated vehicle's server: through its socket, its frame reader and its endpoint."""

from __future__ import annotations

import contextlib
import socket
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import development as dialect

from tests.fuzz import frames
from tests.fuzz.file_targets import shelf
from tests.fuzz.harness import FindingError, Rng
from tests.fuzz.odd import choice
from uasfly.errors import UasflyError
from uasfly.messages import FlightMode
from uasfly.sim.mavlink.framing import FrameReader
from uasfly.sim.mavlink.server import BOOT_S, Server
from uasfly.sim.parameters import ParameterTable
from uasfly.sim.scenario import Scenario
from uasfly.sim.vehicle import SimulatedVehicle

ASKED = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "PARAM_REQUEST_READ", "SET_ATTITUDE_TARGET",
         "TIMESYNC", "FILE_TRANSFER_PROTOCOL", "HEARTBEAT", "PING", "MISSION_COUNT", "PARAM_REQUEST_LIST")  # fmt: skip
COMMANDS = (400, 176, 22, 21, 20, 192, 511, 510, 512, 420)
PARAMETERS = tuple(ParameterTable())


class VehicleSession:
    """A server with a vehicle on the ground, in the air or in offboard, and a client's socket."""

    def __init__(self, rng: Rng) -> None:
        plants = shelf("plant").models
        self._vehicle = SimulatedVehicle(choice(rng, plants), Scenario(name="fuzz"), int(rng.integers(1000)))
        _prepare(self._vehicle, choice(rng, ("ground", "air", "offboard")))
        self._client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._client.bind(("127.0.0.1", 0))
        self._client.setblocking(False)
        self._clock_s = 1000.0
        self._warnings: list[str] = []
        remote = self._client.getsockname()
        self._server = Server(self._vehicle, remote, 0, 1, lambda: self._clock_s, self._warnings.append)
        self._address = ("127.0.0.1", self._server.channel.local_port)

    def feed(self, rng: Rng) -> bool:
        """One datagram; the vehicle lives on for a step or some."""
        good = self._server.channel.frames.good
        self._send(_datagram(rng))
        try:
            self._turn(0.004 if rng.random() < 0.9 else float(rng.uniform(0.0, 0.1)))
        except UasflyError as error:
            raise FindingError("a message ends the simulation") from error
        self._drain()
        self._check_state()
        return self._server.channel.frames.good > good

    def close(self) -> None:
        """The vehicle still answers a command and tells the time."""
        try:
            for _ in range(round((BOOT_S + 0.1) / 0.02)):  # it may have been made to start again
                self._turn(0.02)
            self._drain()
            packer = dialect.MAVLink(None, 255, 190)
            self._send(dialect.MAVLink_timesync_message(0, 123456).pack(packer))
            self._send(dialect.MAVLink_command_long_message(1, 1, 512, 0, 0.0, *(0.0,) * 6).pack(packer))
            self._turn(0.004)
            names = {message.get_type() for message in self._drain()}
            if not {"TIMESYNC", "COMMAND_ACK", "HEARTBEAT"} <= names:
                raise FindingError(f"the vehicle does not answer any more: {sorted(names)}")
        finally:
            self._server.channel.close()
            self._client.close()

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):
            self._client.sendto(data, self._address)

    def _turn(self, step_s: float) -> None:
        self._clock_s += step_s
        self._server.turn()

    def _drain(self) -> list[Any]:
        reader = FrameReader()
        messages: list[Any] = []
        with contextlib.suppress(BlockingIOError):
            while True:
                messages += reader.messages(self._client.recv(65535))
        if reader.bad:
            raise FindingError("the vehicle has sent a damaged frame")
        return messages

    def _check_state(self) -> None:
        truth, odometry = self._vehicle.truth(), self._vehicle.odometry()
        state = (*truth.position_in_world, *truth.velocity_in_world, *truth.quaternion_body_to_world)
        estimate = (*odometry.position_in_world, *odometry.velocity_in_world, *odometry.angular_rate_in_body)
        target = self._vehicle.attitude_target()
        if not np.isfinite((*state, *estimate, *target.quaternion_body_to_world, target.thrust)).all():
            raise FindingError(f"the vehicle's state is not finite: {truth}, {odometry}, {target}")


def _prepare(vehicle: SimulatedVehicle, where: str) -> None:
    vehicle.advance_to(3.0)
    if where == "ground":
        return
    vehicle.arm()
    vehicle.set_mode(FlightMode.TAKEOFF)
    vehicle.advance_to(9.0)
    if where == "offboard":
        vehicle.set_attitude_target(np.array((1.0, 0.0, 0.0, 0.0)), 0.4, None)
        vehicle.set_mode(FlightMode.OFFBOARD)


def _datagram(rng: Rng) -> bytes:
    kind = rng.random()
    if kind < 0.2:
        return frames.packed(rng, _command(rng))
    if kind < 0.35:
        return frames.packed(rng, _parameter(rng))
    return frames.datagram(rng, names=ASKED if kind < 0.6 else ())


def _command(rng: Rng) -> Any:
    """A command that the vehicle knows, with parameters that are mostly small whole numbers."""
    parameters = [float(rng.integers(-1, 25)) if rng.random() < 0.7 else frames.number(rng, "f") for _ in range(7)]
    if rng.random() < 0.5:
        parameters[0] = float(choice(rng, (1, 0, 30, 32, 331, 147, 242, 1)))
    return dialect.MAVLink_command_long_message(1, 1, choice(rng, COMMANDS), 0, *parameters)


def _parameter(rng: Rng) -> Any:
    """A parameter that the vehicle knows, set to anything."""
    name, kind = choice(rng, PARAMETERS), choice(rng, (6, 9, 9, 9, 4))
    return dialect.MAVLink_param_set_message(1, 1, name.encode(), frames.number(rng, "f"), kind)
