"""The vehicle's end of the MAVLink protocol without sockets and clocks: messages in, messages out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from uasfly.messages import TextSample
from uasfly.sim.mavlink.commands import Commands
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import Identity, Sender
from uasfly.sim.mavlink.parameters import Parameters
from uasfly.sim.mavlink.scheduler import Scheduler
from uasfly.sim.mavlink.services import Services
from uasfly.sim.mavlink.setpoints import Setpoints
from uasfly.sim.mavlink.status_messages import status_texts
from uasfly.sim.mavlink.streams import streams
from uasfly.sim.mavlink.vehicle_protocol import Vehicle
from uasfly.sim.mavlink.vehicle_view import VehicleView

MAX_COMPANIONS = 16
MAX_TEXTS = 50
BUSY_INTERVAL_S = 0.004

Handler = Callable[[Message, Sender], list[Message]]


class Endpoint:
    """Answers messages for a vehicle and makes its telemetry.

    The owner advances the vehicle, then calls `poll`; it hands in what it receives by `receive`, after advancing the
    vehicle to the time of arrival.

    Args:
        vehicle: the simulated vehicle.
        identity: its ids.
        now_s: reads the vehicle's clock, which runs on between the steps of the simulation.
        unix_s: reads the time of day.

    Attributes:
        companions: who has sent heartbeats, and the vehicle time of the last one.
        setpoints: counts of setpoints.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        identity: Identity,
        now_s: Callable[[], float],
        unix_s: Callable[[], float],
    ) -> None:
        if "MAV_SYS_ID" in vehicle.parameters:
            vehicle.parameters["MAV_SYS_ID"] = (int, identity.system)
        self.view = VehicleView(vehicle)
        self.companions: dict[Sender, float] = {}
        self.setpoints = Setpoints(self.view, self._say)
        self._identity = identity
        self._texts: deque[TextSample] = deque(maxlen=MAX_TEXTS)
        self._text_number = 0
        self._scheduler = Scheduler(streams(identity, now_s, unix_s))
        self._parameters = Parameters(vehicle, identity)
        commands = Commands(self.view, identity, self._scheduler, self._build, self._say)
        self._handlers: dict[str, Handler] = {
            "HEARTBEAT": self._heartbeat,
            **commands.handlers(),
            **self._parameters.handlers(),
            **self.setpoints.handlers(),
            **Services(identity, now_s).handlers(),
        }

    @property
    def next_due_s(self) -> float:
        """Vehicle time at which `poll` has something to send."""
        if self._parameters.busy or self._texts:
            return self.view.time_s + BUSY_INTERVAL_S
        return self._scheduler.next_due_s

    def receive(self, message: Message) -> list[Message]:
        """Take one message; return the answers to its sender, in order.

        Messages for others, of unknown kind, or with the vehicle's own ids are left alone.
        """
        handler = self._handlers.get(message.get_type())
        if handler is None or not self._identity.is_addressed(message):
            return []
        sender = Sender(message.get_srcSystem(), message.get_srcComponent())
        if sender == Sender(self._identity.system, self._identity.component):
            return []
        answers = handler(message, sender)
        for answer in answers:
            if answer.get_type() == "COMMAND_ACK":
                odd = self.view.vehicle.link_faults.acknowledgement()
                answer.result = answer.result if odd is None else odd
        return answers

    def shift(self, step_s: float) -> None:
        """The vehicle's clock has jumped: what is due stays due."""
        self._scheduler.shift(step_s)

    def poll(self) -> list[Message]:
        """Everything that is due for everybody, now that the vehicle has been advanced."""
        self.view.refresh()
        messages = self._scheduler.collect(self.view)
        self._texts.extend(self.view.vehicle.take_texts())
        while self._texts:
            self._text_number = self._text_number % 0xFFFF + 1
            messages += status_texts(self._texts.popleft(), self._text_number)
        if self._parameters.busy:
            messages += self._parameters.poll()
        return messages

    def _build(self, message_id: int) -> Message | None:
        stream = self._scheduler.stream(message_id)
        built = None if stream is None else stream.build(self.view)
        return built[0] if isinstance(built, tuple) else built

    def _heartbeat(self, _message: Message, sender: Sender) -> list[Message]:
        if sender in self.companions or len(self.companions) < MAX_COMPANIONS:
            self.companions[sender] = self.view.time_s
        return []

    def _say(self, text: TextSample) -> None:
        self._texts.append(text)
