"""COMMAND_LONG and COMMAND_INT as PX4 answers them: mode changes, arming, message intervals and requests, GNSS failure.

Result codes are those of the recording and of PX4's commander and receiver (main of August 2026): a mode or arming that
is refused gives TEMPORARILY_REJECTED (1), a message that cannot be sent DENIED (2), a command that the vehicle does not
know UNSUPPORTED (3), an interval that cannot be set FAILED (4). Commands for others are not answered at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import development as dialect

from uasfly.messages import FlightMode, TextSample
from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import Identity, Sender
from uasfly.sim.mavlink.modes import asked_mode
from uasfly.sim.mavlink.scheduler import Scheduler
from uasfly.sim.mavlink.vehicle_view import VehicleView
from uasfly.sim.sensors import HOME_ALTITUDE_M

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = dialect.MAV_RESULT_DENIED
UNSUPPORTED = dialect.MAV_RESULT_UNSUPPORTED
FAILED = dialect.MAV_RESULT_FAILED

FAILURE_UNIT_GPS = 4
FAILURE_OK, FAILURE_OFF = 0, 1
FORCE_MAGIC = 21196
_CUSTOM_MODE_ENABLED = 1
_HEARTBEAT, _MESSAGE_INTERVAL = 0, 244
_SEVERITY_CRITICAL = 2


@dataclass(frozen=True, slots=True)
class Command:
    """One command; parameters 1 to 7 as floats (those a COMMAND_INT carries as integers are degrees there)."""

    number: int
    parameters: tuple[float, ...]

    def parameter(self, number: int, default: float = 0.0) -> float:
        """Parameter 1..7, the default where it is NaN (which means "not given")."""
        value = self.parameters[number - 1]
        return value if math.isfinite(value) else default


Answer = tuple[int, list[Message]]  # result, and what is sent before the acknowledgement


class Commands:
    """Carries out commands for the vehicle.

    Args:
        view: the vehicle.
        identity: ids that commands must address.
        scheduler: streams whose intervals are set.
        request_message: builds the message of an id, None where it cannot be sent.
        say: takes a status text.
    """

    def __init__(
        self,
        view: VehicleView,
        identity: Identity,
        scheduler: Scheduler,
        request_message: Callable[[int], Message | None],
        say: Callable[[TextSample], None],
    ) -> None:
        self._view = view
        self._vehicle = view.vehicle
        self._identity = identity
        self._scheduler = scheduler
        self._request_message = request_message
        self._say = say
        self._actions: dict[int, Callable[[Command], Answer]] = {
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_or_disarm,
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_NAV_TAKEOFF: self._take_off,
            dialect.MAV_CMD_NAV_LAND: lambda _: self._change_mode(FlightMode.LAND),
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _: self._change_mode(FlightMode.RETURN),
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_GET_MESSAGE_INTERVAL: lambda command: (ACCEPTED, [self._interval(command.parameter(1))]),
            dialect.MAV_CMD_REQUEST_MESSAGE: self._request,
            dialect.MAV_CMD_INJECT_FAILURE: self._inject_failure,
        }

    def handlers(self) -> dict[str, Callable[[Message, Sender], list[Message]]]:
        """What to call for which message."""
        return {"COMMAND_LONG": self._long, "COMMAND_INT": self._int, "SET_MODE": self._old_set_mode}

    def _long(self, message: Message, sender: Sender) -> list[Message]:
        return self._carry_out(
            Command(message.command, tuple(getattr(message, f"param{n}") for n in range(1, 8))), sender
        )

    def _int(self, message: Message, sender: Sender) -> list[Message]:
        parameters = (message.param1, message.param2, message.param3, message.param4)
        place = (message.x * 1e-7, message.y * 1e-7, message.z)
        return self._carry_out(Command(message.command, (*parameters, *place)), sender)

    def _old_set_mode(self, message: Message, _sender: Sender) -> list[Message]:
        """SET_MODE, which is not acknowledged."""
        custom = message.custom_mode
        self._enter(message.base_mode, custom >> 16 & 0xFF, custom >> 24 & 0xFF)
        return []

    def _carry_out(self, command: Command, sender: Sender) -> list[Message]:
        action = self._actions.get(command.number)
        result, before = (UNSUPPORTED, []) if action is None else action(command)
        self._view.refresh()
        # PX4 acknowledges an injected failure to everybody
        target = Sender(0, 0) if command.number == dialect.MAV_CMD_INJECT_FAILURE else sender
        ack = dialect.MAVLink_command_ack_message(command.number, result, 0, 0, target.system, target.component)
        return [*before, ack]

    def _arm_or_disarm(self, command: Command) -> Answer:
        wish = round(command.parameter(1, -1.0))
        if wish not in (0, 1):
            return UNSUPPORTED, []
        forced = round(command.parameter(2)) == FORCE_MAGIC
        accepted, _ = self._vehicle.arm() if wish else self._vehicle.disarm(forced)
        return _verdict(accepted)

    def _set_mode(self, command: Command) -> Answer:
        return self._enter(int(command.parameter(1)), int(command.parameter(2)), int(command.parameter(3)))

    def _enter(self, base_mode: int, main: int, sub: int) -> Answer:
        mode = asked_mode(main, sub) if base_mode & _CUSTOM_MODE_ENABLED else None
        if mode is None:
            text = f"Unsupported mode: base {base_mode}, main {main}, sub {sub}"
            self._say(TextSample(self._view.time_s, _SEVERITY_CRITICAL, text))
            return _verdict(False)
        return self._change_mode(mode)

    def _change_mode(self, mode: FlightMode) -> Answer:
        accepted, _ = self._vehicle.set_mode(mode)  # the vehicle says itself, in a status text, why not
        if accepted:
            self._view.intended_mode = mode
        return _verdict(accepted)

    def _take_off(self, command: Command) -> Answer:
        above_sea = command.parameter(7, math.nan)  # without one PX4 climbs to MIS_TAKEOFF_ALT
        home_above_sea = HOME_ALTITUDE_M - self._view.home.position_m[2]
        if above_sea > home_above_sea:
            self._vehicle.set_takeoff_height(above_sea - home_above_sea)
        return self._change_mode(FlightMode.TAKEOFF)

    def _reposition(self, command: Command) -> Answer:
        """DO_REPOSITION without a place means "stop here"; going to a place is not simulated."""
        wants_hold = int(command.parameter(2)) & 1
        if not wants_hold or any(map(math.isfinite, command.parameters[4:6])):
            return UNSUPPORTED, []
        return self._change_mode(FlightMode.HOLD)

    def _set_interval(self, command: Command) -> Answer:
        message_id = round(command.parameter(1))
        unused = (command.parameter(3), command.parameter(4), command.parameter(7))
        if message_id == _HEARTBEAT or any(map(round, unused)):
            return FAILED, []
        known = self._scheduler.set_interval(message_id, command.parameter(2), self._view.time_s)
        return ACCEPTED if known else FAILED, []

    def _interval(self, message_id: float) -> Message:
        number = round(message_id) & 0xFFFF
        return dialect.MAVLink_message_interval_message(number, self._scheduler.interval_us(number))

    def _request(self, command: Command) -> Answer:
        message_id = round(command.parameter(1))
        if message_id == _MESSAGE_INTERVAL:
            return ACCEPTED, [self._interval(command.parameter(2))]
        message = self._request_message(message_id)
        return (DENIED, []) if message is None else (ACCEPTED, [message])

    def _inject_failure(self, command: Command) -> Answer:
        unit, kind = round(command.parameter(1, -1.0)), round(command.parameter(2, -1.0))
        if unit != FAILURE_UNIT_GPS or kind not in (FAILURE_OK, FAILURE_OFF):
            return UNSUPPORTED, []
        self._vehicle.set_gnss(kind == FAILURE_OK)
        return ACCEPTED, []


def _verdict(accepted: bool) -> Answer:
    return ACCEPTED if accepted else REJECTED, []
