"""An endpoint on a bench: a fake vehicle, a clock that the test moves, and messages that go through real frames."""

from __future__ import annotations

from collections import Counter
from typing import Any

from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.fakes import FakeVehicle
from uasfly.sim.mavlink.endpoint import Endpoint
from uasfly.sim.mavlink.framing import FrameReader
from uasfly.sim.mavlink.identity import Identity

Message = Any

UNIX_S = 1.8e9


class Bench:
    """Endpoint of system 1 in front of a client with the ids of a companion computer."""

    def __init__(self, system_id: int = 1, client: tuple[int, int] = (1, 191), vehicle: Any = None) -> None:
        self.vehicle = FakeVehicle() if vehicle is None else vehicle
        self.clock_ahead_s = 0.0
        self.endpoint = Endpoint(
            self.vehicle,
            Identity(system_id),
            lambda: self.vehicle.time_s + self.clock_ahead_s,
            lambda: UNIX_S,
        )
        self._client = dialect.MAVLink(None, *client)
        self._server = dialect.MAVLink(None, system_id, 1)

    def ask(self, message: Message) -> list[Message]:
        """Answers to a message, both packed and unpacked as on a wire."""
        return [answer for frame in self.frames(message) for answer in FrameReader().messages(frame)]

    def frames(self, message: Message) -> list[bytes]:
        """Frames of the answers to a message."""
        return [bytes(answer.pack(self._server)) for answer in self.endpoint.receive(self.received(message))]

    def received(self, message: Message) -> Message:
        """A message of the client as the endpoint gets it."""
        (received,) = FrameReader().messages(message.pack(self._client))
        return received

    def wired(self, messages: list[Message]) -> list[Message]:
        """Messages of the endpoint as a client reads them."""
        return [unpacked for message in messages for unpacked in FrameReader().messages(message.pack(self._server))]

    def run(self, duration_s: float) -> list[Message]:
        """Everything that is sent while the vehicle runs on for some time."""
        messages = []
        for _ in range(round(duration_s / self.vehicle.step_s)):
            self.vehicle.advance_to(self.vehicle.time_s + self.vehicle.step_s)
            messages += self.endpoint.poll()
        return self.wired(messages)

    def command(self, number: int, *parameters: float, target: tuple[int, int] = (1, 1)) -> list[Message]:
        """Answers to a COMMAND_LONG."""
        seven = (*parameters, *(0.0,) * (7 - len(parameters)))
        return self.ask(dialect.MAVLink_command_long_message(*target, number, 0, *seven))

    def result(self, number: int, *parameters: float) -> int:
        """Result of a command that is answered by an acknowledgement alone."""
        (ack,) = self.command(number, *parameters)
        assert (ack.get_type(), ack.command) == ("COMMAND_ACK", number)
        result: int = ack.result
        return result


def rates_hz(messages: list[Message], duration_s: float) -> dict[str, float]:
    """How often each message came."""
    return {name: count / duration_s for name, count in Counter(m.get_type() for m in messages).items()}


def only(messages: list[Message], name: str) -> list[Message]:
    """Messages of one kind."""
    return [message for message in messages if message.get_type() == name]
