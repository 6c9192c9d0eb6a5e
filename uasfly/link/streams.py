"""Which messages the link asks the vehicle for, and how often."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.link.commands import CommandChannel, Ending
from uasfly.link.inertial import NAME as INERTIAL
from uasfly.link.modes import CMD_REQUEST_MESSAGE, CMD_SET_MESSAGE_INTERVAL
from uasfly.link.rotors import NAME as ROTORS

GPS_GLOBAL_ORIGIN_ID = 49


@dataclass(frozen=True, slots=True)
class Stream:
    """A message that is asked for at a rate."""

    name: str
    message_id: int
    rate_hz: float


STREAMS = (
    Stream("ODOMETRY", 331, 100.0),
    Stream("ATTITUDE_TARGET", 83, 50.0),
    Stream(INERTIAL, 105, 200.0),  # all that PX4 has
    Stream("CURRENT_MODE", 436, 50.0),  # PX4 sends it on a change and twice a second; HEARTBEAT stays at 1 Hz
    Stream("EXTENDED_SYS_STATE", 245, 10.0),
    Stream("ESTIMATOR_STATUS", 230, 5.0),
    Stream("BATTERY_STATUS", 147, 2.0),
)
ROTOR_STREAM = Stream(ROTORS, 291, 50.0)  # only vehicles whose speed controllers tell their speeds have it
TRUTH_STREAMS = (
    Stream("DEBUG_FLOAT_ARRAY", 350, 50.0),  # uasfly's simulated vehicle
    Stream("HIL_STATE_QUATERNION", 115, 50.0),  # PX4's SIH
)


async def ask_for_streams(commands: CommandChannel, want_truth: bool, narrow: bool = False) -> list[str]:
    """Set the message intervals, one after the other.

    Args:
        commands: to the vehicle.
        want_truth: also ask for the true state.
        narrow: the line is a serial one: the inertial unit keeps PX4's own rate (50 Hz), its readings would crowd it.

    Returns:
        Texts about what the vehicle does not send as asked; truth and rotor speeds are not among
            them, few vehicles have them.
    """
    problems = []
    for stream in STREAMS:
        if narrow and stream.name == INERTIAL:
            continue
        outcome = await commands.command(CMD_SET_MESSAGE_INTERVAL, (float(stream.message_id), 1e6 / stream.rate_hz))
        if not outcome.accepted:
            why = "refuses" if outcome.ending is Ending.ANSWERED else "does not answer"
            problems.append(f"{stream.name} at {stream.rate_hz:g} Hz: the vehicle {why}, its own rate stays")
    for stream in (ROTOR_STREAM, *(TRUTH_STREAMS if want_truth else ())):
        await commands.command(CMD_SET_MESSAGE_INTERVAL, (float(stream.message_id), 1e6 / stream.rate_hz), 1)
    if want_truth:
        await commands.command(CMD_REQUEST_MESSAGE, (float(GPS_GLOBAL_ORIGIN_ID),), 1)
    return problems
