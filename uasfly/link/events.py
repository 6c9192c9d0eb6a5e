"""PX4's events: on an onboard link they replace the status texts, which PX4 sends to ground stations only."""

from __future__ import annotations

from collections import deque

from uasfly.link.texts import one_line
from uasfly.messages import TextSample

KEPT = 64
ECHO_WINDOW_S = 2.0


class EventFeed:
    """Texts of events and the current arming problems, filled by MAVSDK's thread and read by the event loop."""

    def __init__(self) -> None:
        self.problems: tuple[str, ...] = ()
        self._texts: deque[TextSample] = deque(maxlen=KEPT)

    def add(self, arrival_s: float, severity: int, text: str) -> None:
        """Take one event."""
        self._texts.append(TextSample(arrival_s, severity, one_line(text)))

    def set_problems(self, problems: tuple[str, ...]) -> None:
        """Take what presently keeps the vehicle from arming or from running its mode."""
        self.problems = tuple(map(one_line, problems))

    def take(self) -> list[TextSample]:
        """All waiting texts, oldest first."""
        taken: list[TextSample] = []
        while self._texts:
            taken.append(self._texts.popleft())
        return taken

    def __bool__(self) -> bool:
        """Whether a text waits."""
        return bool(self._texts)


class EchoFilter:
    """Lets a text through once where the vehicle says it twice, as an event and as a status text."""

    def __init__(self) -> None:
        self._recent: deque[tuple[TextSample, str]] = deque(maxlen=32)

    def passes(self, sample: TextSample, source: str) -> bool:
        """Whether `sample` has not come from another source within 2 s; equal texts of one source all pass."""
        for other, other_source in self._recent:
            age_s = sample.time_s - other.time_s
            if other.text == sample.text and other_source != source and age_s < ECHO_WINDOW_S:
                return False
        self._recent.append((sample, source))
        return True
