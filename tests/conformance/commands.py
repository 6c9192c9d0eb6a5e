"""How requests are answered: commands, message intervals, parameters."""

from __future__ import annotations

import struct
from itertools import zip_longest

from pymavlink.dialects.v20 import development as dialect

from tests.conformance.recording import Event, Message, Recording, contents
from tests.conformance.replay import CLIENT, Flight
from tests.conformance.rows import Row, intended, same, same_order
from tests.conformance.streams import name_of

_RESULTS = {0: "ACCEPTED", 1: "TEMPORARILY_REJECTED", 2: "DENIED", 3: "UNSUPPORTED", 4: "FAILED"}
_COMPONENT_INFORMATION = 395
_SET_INTERVAL, _REQUEST = 511, 512
_REAL32 = dialect.MAV_PARAM_TYPE_REAL32


def command_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Acknowledgements in their order, then parameters."""
    return [*_acknowledgements(recording, flight), *_parameters(recording, flight)]


def _acknowledgements(recording: Recording, flight: Flight) -> list[Row]:
    """Number, result and addressee of each acknowledgement, as they were sent."""
    theirs = contents(recording.received, "COMMAND_ACK")
    rows = [
        same("command", "acknowledgements", len(theirs), len(flight.acknowledgements)),
        same_order("command", "results as noted and as sent", _written(recording), [m.result for m in theirs]),
    ]
    for command, recorded, simulated in zip_longest(recording.of_kind("command"), theirs, flight.acknowledgements):
        aspect = "message interval" if command.values["command"] == _SET_INTERVAL else "command"
        item = f"{command.time_s:.1f} s: {_described(command)}"
        there, here = _verdict(recorded), _verdict(simulated)
        if command.values["params"][0] == _COMPONENT_INFORMATION:
            denied = _verdict(simulated) == "512 DENIED"
            rows.append(intended(aspect, item, there, here, denied, "PX4 serves its metadata, this vehicle has none"))
        else:
            rows.append(same(aspect, item, there, here))
    addressees = [{(m.target_system, m.target_component) for m in ms} for ms in (theirs, flight.acknowledgements)]
    rows.append(same("command", "addressees", str(sorted(addressees[0])), str(sorted(addressees[1]))))
    return rows


def _written(recording: Recording) -> tuple[int, ...]:
    return tuple(event.values["result"] for event in recording.of_kind("ack"))


def _described(command: Event) -> str:
    number, parameters = command.values["command"], command.values["params"]
    if number == _SET_INTERVAL:
        return f"SET_MESSAGE_INTERVAL {name_of(parameters[0])} {parameters[1]} us"
    if number == _REQUEST:
        return f"REQUEST_MESSAGE {name_of(parameters[0])}"
    name = dialect.enums["MAV_CMD"][number].name.removeprefix("MAV_CMD_")
    return f"{name} {' '.join(str(value) for value in parameters[:3])}"


def _verdict(message: Message) -> str:
    return "none" if message is None else f"{message.command} {_RESULTS[message.result]}"


def _parameters(recording: Recording, flight: Flight) -> list[Row]:
    """Type and value of every parameter that was read or set."""
    rows = []
    theirs = _by_name([*contents(recording.received, "PARAM_VALUE"), *contents(recording.received, "PARAM_ERROR")])
    ours = _by_name(flight.parameters)
    asked = [*recording.of_kind("param_read"), *recording.of_kind("param_set")]
    for event in asked:
        name = event.values["name"]
        rows.append(same("parameter", f"{name} ({event.kind[6:]})", _answer(theirs[name]), _answer(ours[name])))
    error = theirs["NO_SUCH_PARAM"], ours["NO_SUCH_PARAM"]
    rows.append(
        same(
            "parameter", "error is addressed to", str(CLIENT), str((error[1].target_system, error[1].target_component))
        )
    )
    reason = "PX4 sends what its memory holds; -1 is what was asked"
    rows.append(
        intended(
            "parameter",
            "error's index",
            str(error[0].param_index),
            str(error[1].param_index),
            error[1].param_index == -1,
            reason,
        )
    )
    return rows


def _by_name(messages: list[Message]) -> dict[str, Message]:
    return {message.param_id: message for message in messages}


def _answer(message: Message) -> str:
    if message.get_type() == "PARAM_ERROR":
        return f"PARAM_ERROR {message.error}"
    if message.param_type == _REAL32:
        return f"{message.param_value:g} (REAL32)"
    (value,) = struct.unpack("<i", struct.pack("<f", message.param_value))
    return f"{value} (INT32)"
