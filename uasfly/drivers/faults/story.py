"""What a flight with a fault tells: its story in words, how soon it reacted, how far it strayed, what it sent.

Read from the flight log, and from the wire where the program itself was stopped. The words of a story, in the order
in which things happened from the fault on (or from the start, where the legs were never reached):

- `warn`, `slow down`, `hold`, `back off`, `end`, `return`, `land`, `hand over`: an alarm's action grew to this
- `flies on`: the action is over, the mission goes on
- `silent`, `streams`: setpoints stopped in flight, and came again
- `stands still`: the control cycle did not run for more than 0.2 s; `streams` when it runs again
- `taken over`, `taken up`: somebody else has the vehicle, the mission was taken up again
- `asks hold`, `asks land`, `asks return`: requests to the vehicle
- `completed`, `aborted`, `killed`: how it ended
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from uasfly.messages import Action, Array, Phase, Request, RequestKind, Setpoint, Status, TruthSample

WORDS = {action: action.value.replace("_", " ") for action in Action}
ASKED = (RequestKind.HOLD, RequestKind.LAND, RequestKind.RETURN)
TRACK_SPACING_M = 0.05
STILL_S = 0.2
SILENT_CYCLES = 5  # fewer cycles without a setpoint are no silence: 0.1 s at 50 Hz


@dataclass(slots=True)
class Story:
    """Reads a log's messages in order.

    Attributes:
        words: (time [s, host], word).
        legs_s: when the legs began first, NaN where they did not.
        ended_s: when uasfly's part ended: it asked for another mode, gave up, or the log ends.
        reason: why the flight ended early.
        texts: announcements with severity 4 or worse.
    """

    words: list[tuple[float, str]] = field(default_factory=list)
    legs_s: float = math.nan
    ended_s: float = math.nan
    reason: str = ""
    texts: list[tuple[float, str]] = field(default_factory=list)
    setpoints: list[tuple[float, Setpoint]] = field(default_factory=list)
    truths: list[TruthSample] = field(default_factory=list)
    track: list[Array] = field(default_factory=list)
    _phase: Phase = Phase.CONNECT
    _cycle_s: float = math.inf
    _action: Action = Action.NOTHING
    _sent_s: float = -math.inf
    _missed: int = 0
    _asked: RequestKind | None = None

    def read(self, messages: Iterable[tuple[float, Any]]) -> None:
        """Take in (log time [s], message), oldest first."""
        for time_s, message in messages:
            match message:
                case Setpoint():
                    self.setpoints.append((time_s, message))
                    self._sent_s = time_s
                case TruthSample():
                    self.truths.append(message)
                case Request():
                    self._request(time_s, message.kind)
                case Status():
                    self._status(time_s, message)
        if math.isnan(self.ended_s) and self.truths:
            self.ended_s = self.truths[-1].time_s

    def from_fault(self, fault_s: float) -> tuple[str, ...]:
        """The words from the fault on; all of them where the legs were never reached."""
        return tuple(word for time_s, word in self.words if math.isnan(self.legs_s) or time_s >= fault_s)

    def reaction_s(self, fault_s: float) -> float | None:
        """Time from the fault to the first word of an action, a silence or a text; None where nothing happened."""
        happened = [time_s for time_s, word in self.words if word not in ("completed", "asks land")]
        happened += [time_s for time_s, _ in self.texts]
        after = [time_s - fault_s for time_s in happened if time_s >= fault_s]
        return min(after, default=None)

    def strayed_m(self, fault_s: float) -> float:
        """Greatest distance of the true position from the path, from the fault until uasfly's part ended."""
        if not self.track:
            return 0.0
        path = np.array(self.track)
        distances = [
            float(np.linalg.norm(path - truth.position_in_world, axis=1).min())
            for truth in self.truths
            if fault_s <= truth.time_s <= self.ended_s
        ]
        return max(distances, default=0.0)

    def _status(self, time_s: float, status: Status) -> None:
        self.texts += [(time_s, text) for severity, text in status.announcements if severity <= 4]
        if status.phase in (Phase.LEGS, Phase.ENGAGE) and time_s - self._cycle_s > STILL_S:
            self._tell(self._cycle_s + STILL_S, "stands still")
            self._tell(time_s, "streams")
            self._sent_s, self._missed = time_s, 0
        self._cycle_s = time_s
        if status.action is not self._action:
            if status.action.grade > self._action.grade:
                self._tell(time_s, WORDS[status.action])
            elif status.phase is Phase.LEGS and status.action.grade <= Action.WARN.grade < self._action.grade:
                self._tell(time_s, "flies on")
            self._action = status.action
        before, self._phase = self._phase, status.phase
        if before is not status.phase:
            self._changed(time_s, before, status.phase)
        if status.phase is Phase.LEGS:
            self._legs(time_s, status)
        self.reason = status.reason or self.reason

    def _changed(self, time_s: float, before: Phase, phase: Phase) -> None:
        if phase is Phase.LEGS:
            if math.isnan(self.legs_s):
                self.legs_s = time_s
            else:
                self._tell(time_s, "taken up")
            self._sent_s, self._missed = time_s, 0
        elif before is Phase.LEGS and phase is Phase.ENGAGE:
            self._tell(time_s, "taken over")
        elif phase in (Phase.DONE, Phase.ABORTED):
            self._tell(time_s, "completed" if phase is Phase.DONE else "aborted")
        if phase in (Phase.ENDING, Phase.DONE, Phase.ABORTED) and math.isnan(self.ended_s):
            self.ended_s = time_s

    def _legs(self, time_s: float, status: Status) -> None:
        """Silence and path; the setpoint of a cycle is logged before its status, under the same time."""
        was_silent = self._missed >= SILENT_CYCLES
        self._missed = 0 if self._sent_s == time_s else self._missed + 1
        if self._missed == SILENT_CYCLES:
            self._tell(time_s, "silent")
        elif was_silent and self._missed == 0:
            self._tell(time_s, "streams")
        reference = status.reference_position_in_world
        if reference is not None and (
            not self.track or float(np.linalg.norm(reference - self.track[-1])) > TRACK_SPACING_M
        ):
            self.track.append(reference)

    def _request(self, time_s: float, kind: RequestKind) -> None:
        if kind in ASKED and kind is not self._asked:
            self._tell(time_s, f"asks {kind.value}")
            self._asked = kind

    def _tell(self, time_s: float, word: str) -> None:
        self.words.append((time_s, word))
