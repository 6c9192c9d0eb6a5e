"""What waits for `poll`: messages of the vehicle by type, texts of its events, and what the link itself says."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable

from uasfly.link.clock import ClockMap
from uasfly.link.decoder import Decoder
from uasfly.link.events import EchoFilter, EventFeed
from uasfly.link.inertial import taken
from uasfly.link.slots import Slot
from uasfly.messages import LinkSample, Sample, TextSample

KEPT = {"STATUSTEXT": 64, "HIGHRES_IMU": 32, "ODOMETRY": 16, "ATTITUDE_TARGET": 16, "DEBUG_FLOAT_ARRAY": 16}
KEPT |= {"HIL_STATE_QUATERNION": 16, "ESC_STATUS": 16}
KEPT_OTHERWISE = 4
TRUTH_MESSAGES = frozenset({"DEBUG_FLOAT_ARRAY", "HIL_STATE_QUATERNION", "GPS_GLOBAL_ORIGIN"})

_log = logging.getLogger("uasfly.link")


class Inbox:
    """Keeps what arrives, and makes samples of it when it is taken; true where something waits.

    MAVSDK's thread fills the slots and the feed of events; everything else happens in the event loop.

    Args:
        clock: maps the vehicle's time stamps to host time.
        want_truth: whether there are slots for the true state too.
        hear: is told each text of the vehicle when it is taken.
        notify: called when the link itself has said something.

    Attributes:
        slots: the slots to be filled, by the name of their message.
        events: the feed to be filled.
    """

    def __init__(
        self, clock: ClockMap, want_truth: bool, hear: Callable[[TextSample], None], notify: Callable[[], None]
    ) -> None:
        self._decoder = Decoder(clock)
        names = [name for name in self._decoder.names if want_truth or name not in TRUTH_MESSAGES]
        self.slots = {name: Slot(name, KEPT.get(name, KEPT_OTHERWISE)) for name in names}
        self.events = EventFeed()
        self._echoes = EchoFilter()
        self._own_samples: list[TextSample | LinkSample] = []
        self._hear = hear
        self._notify = notify

    @property
    def dropped(self) -> Counter[str]:
        """How many messages of each type could not be used; others may count theirs here too."""
        return self._decoder.dropped

    @property
    def heartbeat_s(self) -> float:
        """Host time of the last heartbeat that was taken [s]; NaN before the first."""
        return self._decoder.state.heartbeat_s

    def take(self) -> list[Sample]:
        """All that waits: motion and state, then texts, then the link's own; each group in the order of arrival."""
        now_s = time.monotonic()
        filled = [slot for slot in self.slots.values() if slot.waiting]
        waiting = [(arrival, slot.name, text) for slot in filled for arrival, text in taken(slot)]
        waiting.sort(key=_arrival)
        texts = [(text, "event") for text in self.events.take()]
        samples: list[Sample] = []
        for arrival_s, name, text in waiting:
            sample = self._decoder.decode(name, text, arrival_s)
            if isinstance(sample, TextSample):
                texts.append((sample, name))
            elif sample is not None:
                samples.append(sample)
        texts.extend((text, "STATUSTEXT") for text in self._decoder.overdue_texts(now_s))
        for sample, source in texts:
            if self._echoes.passes(sample, source):
                self._hear(sample)
                samples.append(sample)
        samples.extend(self._own_samples)
        self._own_samples.clear()
        return samples

    def say(self, severity: int, text: str) -> None:
        """Announce something to the pilot, with its MAVLink severity."""
        _log.info("%s", text)  # no warning: that would go to a terminal on which somebody draws
        self._own_samples.append(TextSample(time.monotonic(), severity, text))
        self._notify()

    def add(self, sample: LinkSample) -> None:
        """Add what the link itself has found out."""
        self._own_samples.append(sample)

    def __bool__(self) -> bool:
        """Whether something waits."""
        return bool(self._own_samples or self.events or any(slot.waiting for slot in self.slots.values()))


def _arrival(item: tuple[float, str, str]) -> float:
    return item[0]
