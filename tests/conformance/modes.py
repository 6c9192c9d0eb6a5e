"""Modes, heartbeats, landed states and estimator flags: their order, and when they change."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

from tests.conformance.recording import Message, Received, Recording
from tests.conformance.replay import Flight, ModeChange
from tests.conformance.rows import Row, close, same_order

COMMANDER_S = 0.1  # PX4's commander looks at least ten times a second
_SETTLING_S = 0.25  # heights and contacts with the ground: two flights are not the same to a centimetre
_FAST_S, _SLOW_S = 0.2, 1.0  # how often a message is sent, and not at the same moment by both
_SLOW_REASON = "sent once a second by both, PX4 0.23 s later"
_GPS, _POSITION_CONTROL, _PREARM = 1 << 5, 1 << 14, 1 << 28  # MAV_SYS_STATUS_SENSOR
_NAMES = {2: "take-off", 3: "Hold", 5: "Return", 6: "Land", 20: "Descend"}

Changes = list[tuple[float, float, Hashable]]  # last time without, first time with, the value


def mode_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Everything that changes in the course of the flight."""
    return [
        *_modes(recording, flight),
        *_heartbeats(recording, flight),
        *_landed(recording, flight),
        *_estimator(recording, flight),
    ]


def changes(received: list[Received], name: str, value: Callable[[Message], Hashable]) -> Changes:
    """When a value of a message changed; the first one counts as a change."""
    found: Changes = []
    before_s = -np.inf
    for one in received:
        if one.message is None or one.message.get_type() != name:
            continue
        now = value(one.message)
        if not found or found[-1][2] != now:
            found.append((before_s, one.time_s, now))
        before_s = one.time_s
    return found


def _mode_name(custom_mode: int, armed: bool) -> str:
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24
    mode = "offboard" if main == 6 else _NAMES.get(sub, str(sub)) if main == 4 else f"main {main}"
    return f"{mode}, {'armed' if armed else 'disarmed'}"


def _modes(recording: Recording, flight: Flight) -> list[Row]:
    """Each change must fall between the two heartbeats that it lies between in the recording."""
    theirs = changes(recording.received, "HEARTBEAT", lambda m: (m.custom_mode, bool(m.base_mode & 128)))
    noted = [(e.values["main"], e.values["sub"], e.values["armed"]) for e in recording.of_kind("mode")]
    read = [(v[0] >> 16 & 0xFF, v[0] >> 24, v[1]) for _, _, v in theirs]  # type: ignore[index]
    ours = flight.modes
    rows = [
        same_order("mode", "changes as noted and as sent", noted, read),
        same_order("mode", "order", [v for _, _, v in theirs], [(m.custom_mode, m.armed) for m in ours]),
    ]
    for (after_s, by_s, value), mode in list(zip(theirs, ours, strict=False))[1:]:
        rows.append(_window("mode", _mode_name(*value), after_s, by_s, mode))  # type: ignore[misc]
    return rows


def _window(aspect: str, item: str, after_s: float, by_s: float, mode: ModeChange) -> Row:
    outside = max(0.0, after_s - mode.time_s, mode.time_s - by_s)
    recorded = f"{after_s:.2f} to {by_s:.2f} s"
    reason = "PX4's commander looks ten times a second; the recording shows it by heartbeats"
    return Row(
        aspect,
        item,
        recorded,
        f"{mode.time_s:.2f} s",
        f"{outside:.2f} s",
        f"{COMMANDER_S:.2f} s",
        outside <= COMMANDER_S,
        reason,
    )


def _heartbeats(recording: Recording, flight: Flight) -> list[Row]:
    """base_mode, custom_mode and system_status (3 standby, 4 active, 5 failsafe, 0 cannot be armed), and when."""
    both = _both(recording, flight, "HEARTBEAT", lambda m: (m.base_mode, m.custom_mode, m.system_status))
    return _compared("heartbeat", "base, custom mode, status", *both, _SLOW_S, _SLOW_REASON)


def _landed(recording: Recording, flight: Flight) -> list[Row]:
    """1 on the ground, 3 taking off, 2 in the air."""
    both = _both(recording, flight, "EXTENDED_SYS_STATE", lambda m: m.landed_state)
    reason = "sent every 0.2 s; heights and contact with the ground to a few centimetres"
    return _compared("landed state", "landed_state", *both, _FAST_S + _SETTLING_S, reason)


def _estimator(recording: Recording, flight: Flight) -> list[Row]:
    """Flags on the ground, in flight, without GNSS and after it; the health bits and the GNSS that follow them."""
    flags = _both(recording, flight, "ESTIMATOR_STATUS", lambda m: m.flags)
    health = _both(recording, flight, "SYS_STATUS", _health)
    present = _both(recording, flight, "SYS_STATUS", lambda m: bool(m.onboard_control_sensors_present & _GPS))
    reason = "sent every 0.2 s by both; PX4's commander looks ten times a second"
    return [
        *_compared("estimator", "ESTIMATOR_STATUS.flags", *flags, _SLOW_S, _SLOW_REASON),
        *_compared("health", "position control healthy, ready to arm", *health, _FAST_S + COMMANDER_S, reason),
        *_compared("health", "GNSS present", *present, _FAST_S + COMMANDER_S, reason),
    ]


def _health(message: Message) -> tuple[bool, bool]:
    health = message.onboard_control_sensors_health
    return bool(health & _POSITION_CONTROL), bool(health & _PREARM)


def _both(
    recording: Recording, flight: Flight, name: str, value: Callable[[Message], Hashable]
) -> tuple[Changes, Changes]:
    """Changes of a value since the first request, in the recording and in the flight."""
    begin = recording.phase("identify")[0]
    theirs, ours = (
        changes([one for one in side if one.time_s >= begin], name, value)
        for side in (recording.received, flight.received)
    )
    return theirs, ours


def _compared(aspect: str, what: str, theirs: Changes, ours: Changes, tolerance_s: float, reason: str) -> list[Row]:
    """Order, then the time of each change but the first, which is the beginning."""
    rows = [same_order(aspect, f"{what}: order", *([value for _, _, value in side] for side in (theirs, ours)))]
    for (_, theirs_s, value), (_, ours_s, _) in list(zip(theirs, ours, strict=False))[1:]:
        rows.append(close(aspect, f"{what}: {value}", (theirs_s, ours_s), tolerance_s, "s", reason))
    return rows
