"""When each stream is due, on the vehicle's clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.vehicle_view import VehicleView

_NEVER = math.inf
_TOLERANCE_S = 1e-9
RETRY_S = 0.02  # a stream without news is asked again after this


@dataclass(frozen=True, slots=True)
class Stream:
    """One message that is sent by itself.

    Attributes:
        message_id: MAVLink's number of the message.
        rate_hz: default rate, 0 for one that is off until it is asked for.
        build: makes the message, or those that go together; None where there is nothing new to send, which
            leaves the stream due.
        max_rate_hz: rate above which a request is cut.
    """

    message_id: int
    rate_hz: float
    build: Callable[[VehicleView], Message | tuple[Message, ...] | None]
    max_rate_hz: float


class _Timer:
    __slots__ = ("due_s", "interval_s", "stream")

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        self.interval_s = 1.0 / stream.rate_hz if stream.rate_hz > 0.0 else _NEVER
        self.due_s = 0.0 if stream.rate_hz > 0.0 else _NEVER

    def count_as_sent(self, time_s: float, has_news: bool) -> None:
        if not has_news:
            self.due_s = time_s + RETRY_S
            return
        self.due_s += self.interval_s
        if self.due_s <= time_s:
            self.due_s = time_s + self.interval_s


class Scheduler:
    """Holds the interval of every stream and says which are due."""

    def __init__(self, streams: Iterable[Stream]) -> None:
        self._timers = {stream.message_id: _Timer(stream) for stream in streams}
        self._running: list[_Timer] = []
        self.next_due_s = _NEVER
        self._find_running()

    def stream(self, message_id: int) -> Stream | None:
        """The stream of a message, None where there is none."""
        timer = self._timers.get(message_id)
        return None if timer is None else timer.stream

    def shift(self, step_s: float) -> None:
        """Move everything that is due along with a clock that has jumped."""
        for timer in self._timers.values():
            timer.due_s += step_s
        self._find_running()

    def collect(self, view: VehicleView) -> list[Message]:
        """Messages of the streams that are due at the view's time, each counted as sent.

        Intervals are kept on average. A stream that was held up for more than one interval goes on from now, so that
        nothing is sent in a burst.
        """
        time_s = view.time_s
        if time_s < self.next_due_s - _TOLERANCE_S:
            return []
        messages: list[Message] = []
        next_due_s = _NEVER
        for timer in self._running:
            if timer.due_s <= time_s + _TOLERANCE_S:
                message = timer.stream.build(view)
                timer.count_as_sent(time_s, message is not None)
                if isinstance(message, tuple):
                    messages.extend(message)
                elif message is not None:
                    messages.append(message)
            next_due_s = min(next_due_s, timer.due_s)
        self.next_due_s = next_due_s
        return messages

    def set_interval(self, message_id: int, interval_us: float, time_s: float) -> bool:
        """Set a stream's interval as SET_MESSAGE_INTERVAL means it: negative off, 0 default, else microseconds.

        Returns:
            Whether there is such a stream.
        """
        timer = self._timers.get(message_id)
        if timer is None:
            return False
        stream = timer.stream
        rate_hz = stream.rate_hz if interval_us == 0.0 else 1e6 / interval_us
        timer.interval_s = 1.0 / min(rate_hz, stream.max_rate_hz) if rate_hz > 0.0 else _NEVER
        timer.due_s = time_s if rate_hz > 0.0 else _NEVER
        self._find_running()
        return True

    def interval_us(self, message_id: int) -> int:
        """A stream's interval as PX4 gives it in MESSAGE_INTERVAL: microseconds, -1 when it is off or there is none."""
        timer = self._timers.get(message_id)
        return -1 if timer is None or timer.interval_s is _NEVER else round(timer.interval_s * 1e6)

    def _find_running(self) -> None:
        self._running = [timer for timer in self._timers.values() if timer.due_s < _NEVER]
        self.next_due_s = min((timer.due_s for timer in self._running), default=_NEVER)
