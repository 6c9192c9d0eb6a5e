"""The parameter protocol as PX4 speaks it: names and indices, integers carried as the bits of a float, errors told.

The recording shows an unknown name answered by PARAM_ERROR (1, does not exist) rather than by silence.
"""

from __future__ import annotations

import itertools
import math
import struct
from collections.abc import Callable

from pymavlink.dialects.v20 import development as dialect

from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import Identity, Sender
from uasfly.sim.mavlink.vehicle_protocol import Vehicle

DOES_NOT_EXIST, OUT_OF_RANGE, TYPE_UNSUPPORTED, TYPE_MISMATCH = 1, 2, 6, 7  # MAV_PARAM_ERROR
INT32: int = dialect.MAV_PARAM_TYPE_INT32
REAL32: int = dialect.MAV_PARAM_TYPE_REAL32
Handler = Callable[[Message, Sender], list[Message]]

LIST_BURST = 20  # parameters of a list that PX4 sends in one turn of its loop


class Parameters:
    """Answers reads, lists and sets of the vehicle's parameters, which are indexed in the order of their names."""

    def __init__(self, vehicle: Vehicle, identity: Identity) -> None:
        self._parameters = vehicle.parameters
        self._identity = identity
        self._listing: list[str] = []

    def handlers(self) -> dict[str, Handler]:
        """What to call for which message."""
        handlers = {"PARAM_REQUEST_READ": self._read, "PARAM_REQUEST_LIST": self._list, "PARAM_SET": self._set}
        return {name: self._for_this_system(handler) for name, handler in handlers.items()}

    @property
    def busy(self) -> bool:
        """Whether a list is being sent."""
        return bool(self._listing)

    def poll(self) -> list[Message]:
        """The next few parameters of a list that was asked for."""
        burst, self._listing = self._listing[:LIST_BURST], self._listing[LIST_BURST:]
        return [self._value(name) for name in burst]

    def _for_this_system(self, handler: Handler) -> Handler:
        """PX4 leaves parameter requests alone that name no system (target 0)."""
        return lambda message, sender: (
            handler(message, sender) if message.target_system == self._identity.system else []
        )

    def _list(self, _message: Message, _sender: Sender) -> list[Message]:
        self._listing = sorted(self._parameters)
        return []

    def _read(self, message: Message, sender: Sender) -> list[Message]:
        index = message.param_index
        by_index = itertools.islice(sorted(self._parameters), max(0, index), None)
        name: str = message.param_id if index < 0 else next(by_index, "")
        if name not in self._parameters:
            return [_error(sender, name, index, DOES_NOT_EXIST)]
        return [self._value(name)]

    def _set(self, message: Message, sender: Sender) -> list[Message]:
        name = message.param_id
        if name not in self._parameters:
            return [_error(sender, name, -1, DOES_NOT_EXIST)]
        if message.param_type not in (INT32, REAL32):
            return [_error(sender, name, -1, TYPE_UNSUPPORTED)]
        kind = self._parameters[name][0]
        if message.param_type != _type_code(kind):
            return [_error(sender, name, -1, TYPE_MISMATCH)]
        value: float = message.param_value if kind is float else _int_of_bits(message.param_value)
        if not math.isfinite(value):
            return [_error(sender, name, -1, OUT_OF_RANGE)]
        self._parameters[name] = (kind, value)
        return [self._value(name)]

    def _value(self, name: str) -> Message:
        kind, value = self._parameters[name]
        index = sorted(self._parameters).index(name)
        content = float(value) if kind is float else _bits_of_int(int(value))
        return dialect.MAVLink_param_value_message(
            name.encode(), content, _type_code(kind), len(self._parameters), index
        )


def _bits_of_int(value: int) -> float:
    """The float that has the bits of a 32-bit integer."""
    content: float = struct.unpack("<f", struct.pack("<i", value))[0]
    return content


def _int_of_bits(value: float) -> int:
    """The 32-bit integer that has the bits of a float."""
    bits = struct.unpack("<i", struct.pack("<f", value))
    return int(bits[0])


def _type_code(kind: type) -> int:
    return REAL32 if kind is float else INT32


def _error(sender: Sender, name: str, index: int, code: int) -> Message:
    return dialect.MAVLink_param_error_message(sender.system, sender.component, name.encode(), index, code)
