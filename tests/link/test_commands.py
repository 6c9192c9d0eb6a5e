"""Commands and parameters: repeats, acknowledgements, newest wins; without a vehicle."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from tests.link.waiting import arrived
from uasfly.link.commands import CommandChannel, Ending, Outcome
from uasfly.link.parameters import ParameterChannel, same_value

SET_MODE, ARM = 176, 400
INTERVAL_S = 0.02


class Wire:
    """Records what is sent."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []

    def send(self, name: str, fields: str) -> bool:
        """As `Bridge.send`."""
        self.sent.append(json.loads(fields) | {"name": name})
        return True

    def modes(self) -> list[float]:
        """Main modes of the mode commands sent."""
        return [message["param2"] for message in self.sent if message["command"] == SET_MODE]


def ack(command: int, result: int, **changed: int) -> dict[str, int]:
    """COMMAND_ACK to this computer."""
    return {"command": command, "result": result, "target_system": 1, "target_component": 195} | changed


async def give(channel: CommandChannel, number: int, *parameters: float) -> asyncio.Task[Outcome]:
    """Begin with a command; it has been sent when this returns."""
    task = asyncio.create_task(channel.command(number, parameters))
    await asyncio.sleep(0)
    return task


async def test_a_command_without_an_answer_is_repeated_four_times() -> None:
    """With a rising confirmation, as MAVLink wants it; then it ends without an answer."""
    wire = Wire()
    channel = CommandChannel(wire.send, 1, INTERVAL_S)
    outcome = await channel.command(ARM, (1.0,))
    assert outcome.ending is Ending.NO_ANSWER
    assert not outcome.accepted
    assert [message["confirmation"] for message in wire.sent] == [0, 1, 2, 3]
    assert {message["param1"] for message in wire.sent} == {1.0}


@pytest.mark.parametrize("result", [0, 1, 4, 7, 255])
async def test_an_answer_ends_the_repeats(result: int) -> None:
    """Whatever its value; answers to others, of other commands and late ones are left alone."""
    wire = Wire()
    channel = CommandChannel(wire.send, 1, 10.0)
    channel.acknowledge(ack(ARM, 0))
    task = await give(channel, ARM, 1.0)
    channel.acknowledge(ack(SET_MODE, 0))
    channel.acknowledge(ack(ARM, 0, target_component=190))
    channel.acknowledge(ack(ARM, 0, target_system=255))
    assert not task.done()
    channel.acknowledge(ack(ARM, result))
    assert await task == Outcome(Ending.ANSWERED, result)
    assert len(wire.sent) == 1
    channel.acknowledge(ack(ARM, 0))


async def test_progress_stops_the_repeats_and_waits_for_the_end() -> None:
    """MAV_RESULT_IN_PROGRESS keeps the command waiting beyond its usual patience."""
    wire = Wire()
    channel = CommandChannel(wire.send, 1, INTERVAL_S)
    task = await give(channel, ARM, 1.0)
    channel.acknowledge(ack(ARM, 5))
    await asyncio.sleep(8 * INTERVAL_S)
    assert len(wire.sent) == 1
    assert not task.done()
    channel.acknowledge(ack(ARM, 0))
    assert (await task).accepted


async def test_a_newer_command_replaces_the_older_one_and_its_late_answer() -> None:
    """Offboard, unanswered, then hold: offboard is not repeated, and its late refusal is not taken for hold's."""
    wire = Wire()
    channel = CommandChannel(wire.send, 1, 10.0)
    offboard = await give(channel, SET_MODE, 1.0, 6.0)
    hold = await give(channel, SET_MODE, 1.0, 4.0, 3.0)
    assert (await offboard).ending is Ending.REPLACED
    channel.acknowledge(ack(SET_MODE, 1))
    assert not hold.done()
    channel.acknowledge(ack(SET_MODE, 0))
    assert (await hold).accepted
    assert wire.modes() == [6.0, 4.0]


async def test_a_lost_late_answer_costs_one_repeat_only() -> None:
    """When the older command's answer never comes, the first one taken for it is made up for by the repeat's."""
    wire = Wire()
    channel = CommandChannel(wire.send, 1, 0.5)
    offboard = await give(channel, SET_MODE, 1.0, 6.0)
    offboard.cancel()
    await asyncio.sleep(0)
    hold = await give(channel, SET_MODE, 1.0, 4.0, 3.0)
    channel.acknowledge(ack(SET_MODE, 0))
    await arrived(lambda: len(wire.modes()) == 3)
    channel.acknowledge(ack(SET_MODE, 0))
    assert (await hold).accepted
    assert set(wire.modes()[1:]) == {4.0}


async def test_commands_of_different_numbers_do_not_touch_each_other() -> None:
    """Arming goes on while a mode command waits."""
    channel = CommandChannel(Wire().send, 1, 10.0)
    mode, arm = await give(channel, SET_MODE, 1.0, 6.0), await give(channel, ARM, 1.0)
    channel.acknowledge(ack(ARM, 0))
    assert (await arm).accepted
    channel.acknowledge(ack(SET_MODE, 2))
    assert await mode == Outcome(Ending.ANSWERED, 2)


async def test_a_parameter_is_set_until_it_is_read_back() -> None:
    """Another parameter's value and one that is not finite do not count; without an answer there is none."""
    wire = Wire()
    channel = ParameterChannel(wire.send, 1, INTERVAL_S)
    task = asyncio.create_task(channel.set("MIS_TAKEOFF_ALT", 2.2))
    await arrived(lambda: len(wire.sent) >= 2)
    channel.receive({"param_id": "MPC_THR_HOVER", "param_value": 2.2})
    channel.receive({"param_id": "MIS_TAKEOFF_ALT", "param_value": None})
    assert not task.done()
    channel.receive({"param_id": "MIS_TAKEOFF_ALT", "param_value": 2.2000000476837158})
    assert same_value(await task or 0.0, 2.2)
    assert {(message["param_id"], message["param_value"], message["param_type"]) for message in wire.sent} == {
        ("MIS_TAKEOFF_ALT", 2.2, 9)
    }
    assert await channel.set("MIS_TAKEOFF_ALT", 3.0) is None
    channel.receive({"param_id": "MIS_TAKEOFF_ALT", "param_value": 3.0})


def test_values_are_compared_in_single_precision() -> None:
    """The wire rounds to 24 bits; a centimetre of height is not rounding."""
    assert same_value(4.099999904632568, 4.1)
    assert not same_value(4.11, 4.1)
