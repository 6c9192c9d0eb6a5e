"""Which messages come, how often, and how often after SET_MESSAGE_INTERVAL."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from tests.conformance.recording import Received, Recording
from tests.conformance.replay import Flight
from tests.conformance.rows import Row, close, intended, same
from uasfly.sim.mavlink.sensor_messages import ESC_STATUS_ID
from uasfly.sim.mavlink.streams import SILENT_IDS

IDLE = "default streams, idle"
INTERVALS = "message intervals"
IN_FLIGHT = "pitch -10 deg"  # eight seconds in offboard
_NO_DEVICE = "device that it does not have"
_NOT_IN_PYMAVLINK = "not in pymavlink's dialects"
_NO_TARGET = "does not tell the position targets of its own modes"
# what the simulated vehicle leaves out, and why; intervals for the streams among them are accepted in silence
LEFT_OUT = {
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: _NO_DEVICE,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: _NO_DEVICE,
    dialect.MAVLINK_MSG_ID_GNSS_INTEGRITY: _NO_DEVICE,
    dialect.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION: _NO_DEVICE,
    dialect.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM: _NO_DEVICE,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: _NO_TARGET,
    **dict.fromkeys((8, 290, 291, 380, 395, 410, 411, 514), _NOT_IN_PYMAVLINK),
}
_UNLISTED_NAMES = {
    8: "LINK_NODE_STATUS",
    290: "ESC_INFO",
    291: "ESC_STATUS",
    300: "PROTOCOL_VERSION",
    380: "TIME_ESTIMATE_TO_TARGET",
    395: "COMPONENT_INFORMATION",
    410: "EVENT",
    411: "CURRENT_EVENT_SEQUENCE",
    514: "ESTIMATOR_SENSOR_FUSION_STATUS",
}
_EVENTS = frozenset({410, 411})
_ADDED = {dialect.MAVLINK_MSG_ID_STATUSTEXT: "in the place of EVENT (410)"}
_ANSWERS = frozenset(
    {
        dialect.MAVLINK_MSG_ID_COMMAND_ACK,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    }
)
_RATE_REASON = "2 %, or one message that the edges of the phase may cost"
_SET = (331, 32, 31, 83, 147)  # messages whose interval was set
_SETTLED_S = 2.4  # from the beginning of the phase until all intervals are set


def name_of(number: int) -> str:
    """Name of a message, its number where there is none."""
    listed = dialect.mavlink_map.get(number)
    if listed is not None:
        return str(listed.msgname)
    return _UNLISTED_NAMES.get(number, f"message {number}")


def stream_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Message set and rates."""
    return [
        *_message_set(recording, flight),
        *_silent_intervals(recording),
        *_rates("default rate", recording, flight, IDLE),
        *_rates("rate in flight", recording, flight, IN_FLIGHT),
        *_set_rates(recording, flight),
    ]


def _message_set(recording: Recording, flight: Flight) -> list[Row]:
    """Every message of the whole recording, and every one that only the simulated vehicle sends."""
    idle = {one.number for one in recording.during(IDLE)}
    ours_idle = {one.number for one in flight.during(recording.phase(IDLE))}
    theirs = {one.number for one in recording.received} - _ANSWERS
    begin = recording.received[0].time_s
    ours = {one.number for one in flight.received if one.time_s >= begin}
    rows = []
    for number in sorted(theirs | ours, key=lambda number: (number not in idle, name_of(number))):
        there, here = _presence(number, idle, theirs), _presence(number, ours_idle, ours)
        reason = LEFT_OUT.get(number) or _ADDED.get(number)
        if reason is None:
            rows.append(same("message set", name_of(number), there, here))
        else:
            found = (number in theirs, number in ours) == (number in LEFT_OUT, number in _ADDED)
            rows.append(intended("message set", name_of(number), there, here, found, reason))
    return [*rows, *_positions_in_flight(recording, flight)]


def _presence(number: int, idle: set[int], all_: set[int]) -> str:
    return "from the start" if number in idle else "later" if number in all_ else "no"


def _positions_in_flight(recording: Recording, flight: Flight) -> list[Row]:
    """POSITION_TARGET_LOCAL_NED, which the simulated vehicle sends on the ground only."""
    number = dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED
    begin = recording.phase("offboard in flight without setpoints")
    theirs = sum(one.number == number for one in recording.during("offboard in flight without setpoints"))
    ours = sum(one.number == number for one in flight.during(begin))
    item = f"{name_of(number)} in Hold"
    return [
        intended(
            "message set", item, "yes" if theirs else "no", "yes" if ours else "no", theirs > 0 == ours, _NO_TARGET
        )
    ]


def _silent_intervals(recording: Recording) -> list[Row]:
    """Intervals of the streams that are left out are accepted, as PX4 accepts them where it has no data."""
    streamed = {one.number for one in recording.received} & set(LEFT_OUT) - _EVENTS
    silent = ", ".join(str(number) for number in sorted(streamed & {*SILENT_IDS, ESC_STATUS_ID}))
    wanted = ", ".join(str(number) for number in sorted(streamed))
    return [same("message set", "streams left out whose interval may be set", wanted, silent)]


def _rates(aspect: str, recording: Recording, flight: Flight, phase: str) -> list[Row]:
    begin, end = recording.phase(phase)
    duration = end - begin
    theirs, ours = _counts(recording.during(phase)), _counts(flight.during((begin, end)))
    return [
        _rate(aspect, number, theirs[number], ours[number], duration)
        for number in sorted(theirs | ours, key=name_of)
        if number not in LEFT_OUT
    ]


def _set_rates(recording: Recording, flight: Flight) -> list[Row]:
    begin, end = recording.phase(INTERVALS)
    begin += _SETTLED_S
    theirs = _counts(one for one in recording.during(INTERVALS) if one.time_s >= begin)
    ours = _counts(flight.during((begin, end)))
    return [_rate("rate as set", number, theirs[number], ours[number], end - begin) for number in _SET]


def _counts(received: Iterable[Received]) -> Counter[int]:
    return Counter(one.number for one in received)


def _rate(aspect: str, number: int, theirs: int, ours: int, duration_s: float) -> Row:
    tolerance = (max(0.02 * theirs, 1.0) + 1e-9) / duration_s
    return close(aspect, name_of(number), (theirs / duration_s, ours / duration_s), tolerance, "Hz", _RATE_REASON)
