"""What PX4 does when something stops: setpoints, GNSS; how soon, and what it sends meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from tests.conformance.modes import COMMANDER_S
from tests.conformance.recording import Message, Received, Recording, contents
from tests.conformance.replay import HOLD, RESUME, STOP, Flight, setpoints
from tests.conformance.rows import Row, at_least, at_most, close
from uasfly.messages import Array

DISARMED = "offboard while disarmed without setpoints"
_SINKING_M_S = 0.3
_LOOKS = "PX4's commander looks ten times a second"


def failsafe_rows(recording: Recording, flight: Flight) -> list[Row]:
    """Loss and return of the setpoints, loss of GNSS."""
    return [
        *_setpoints(recording, flight),
        *_silences(recording, flight),
        *_gnss(recording, flight),
        *_accuracy(recording, flight),
    ]


def _setpoints(recording: Recording, flight: Flight) -> list[Row]:
    """How long after the last setpoint Hold sets its first target, and after the first one offboard is back."""
    sides = recording.received, flight.received
    stopped_s = max(one.time_s for one in setpoints(recording) if one.time_s <= recording.phase(STOP)[0])
    resumed_s = recording.phase(RESUME)[0]
    left = [_target(side, stopped_s + 0.1, _is_not(_target_at(side, stopped_s + 0.1))) - stopped_s for side in sides]
    back = [_target(side, resumed_s, _is_level) - resumed_s for side in sides]
    return [
        close("failsafe", "last setpoint to Hold's first target", left, COMMANDER_S, "s", _LOOKS),
        close("failsafe", "first setpoint to offboard again", back, COMMANDER_S, "s", _LOOKS),
    ]


def _silences(recording: Recording, flight: Flight) -> list[Row]:
    """How long ATTITUDE_TARGET pauses in offboard where no setpoints come."""
    sides = recording.received, flight.received
    reason = "two intervals of the stream"
    return [
        close(
            "failsafe",
            f"silence of ATTITUDE_TARGET: {phase}",
            [_pause(side, *recording.phase(phase)) for side in sides],
            0.1,
            "s",
            reason,
        )
        for phase in (DISARMED, STOP)
    ]


def _pause(received: list[Received], begin_s: float, end_s: float) -> float:
    """The longest time without ATTITUDE_TARGET."""
    times = [one.time_s for one in received if begin_s - 0.2 < one.time_s < end_s and one.number == 83]
    return max(later - earlier for earlier, later in pairwise(times))


def _gnss(recording: Recording, flight: Flight) -> list[Row]:
    """When the vehicle begins to sink without GNSS, and how fast."""
    off_s = recording.phase(HOLD)[0]
    falls = [_falling(side, off_s) for side in (recording.received, flight.received)]
    sinking = [float(fall[0, 0]) - off_s for fall in falls]
    times = [fall[:, 0] - fall[0, 0] for fall in falls]
    speeds = [float(fall[(time > 1.5) & (time < 3.5), 1].mean()) for fall, time in zip(falls, times, strict=True)]
    reason = "noise of the velocity: 0.01 m/s wandering, three sigma"
    return [
        close("failsafe", f"GNSS off to sinking by {_SINKING_M_S} m/s", sinking, COMMANDER_S, "s", _LOOKS),
        close("failsafe", "speed of sinking in Descend", speeds, 0.03, "m/s", reason),
    ]


def _target_at(received: list[Received], time_s: float) -> Message:
    """The last ATTITUDE_TARGET before a time."""
    return contents([one for one in received if one.time_s <= time_s], "ATTITUDE_TARGET")[-1]


def _target(received: list[Received], after_s: float, wanted: Callable[[Message], bool]) -> float:
    """Time stamp of the first ATTITUDE_TARGET of a kind that comes after a time."""
    targets = contents([one for one in received if one.time_s > after_s], "ATTITUDE_TARGET")
    return float(next(m.time_boot_ms for m in targets if wanted(m))) * 1e-3


def _is_not(other: Message) -> Callable[[Message], bool]:
    return lambda message: not np.allclose(message.q, other.q, atol=1e-5)


def _is_level(message: Message) -> bool:
    return bool(np.allclose(message.q[1:], 0.0, atol=1e-6))


def _falling(received: list[Received], after_s: float) -> Array:
    """Time and speed downwards, (n, 2), from when it first exceeds the limit."""
    messages = contents([one for one in received if one.time_s > after_s], "LOCAL_POSITION_NED")
    rows = np.array([(m.time_boot_ms * 1e-3, m.vz) for m in messages])
    return rows[int(np.argmax(rows[:, 1] > _SINKING_M_S)) :]


def _accuracy(recording: Recording, flight: Flight) -> list[Row]:
    """ESTIMATOR_STATUS shows in flight that GNSS is off: over a metre after five seconds."""
    off_s = recording.phase(HOLD)[0]
    sides = recording.received, flight.received
    before, after = (
        [max(_accuracies(side, off_s + begin, off_s + end)) for side in sides]
        for begin, end in ((-5.0, 0.0), (4.5, 6.5))
    )
    return [
        at_most(
            "estimator", "pos_horiz_accuracy with GNSS", f"{before[0]:.2f} m", before[1], 0.5, "m", "must be below"
        ),
        at_least(
            "estimator", "pos_horiz_accuracy 5 s without", f"{after[0]:.2f} m", after[1], 1.0, "m", "must be above"
        ),
    ]


def _accuracies(received: list[Received], begin_s: float, end_s: float) -> list[float]:
    chosen = [one for one in received if begin_s < one.time_s < end_s]
    return [m.pos_horiz_accuracy for m in contents(chosen, "ESTIMATOR_STATUS")]
