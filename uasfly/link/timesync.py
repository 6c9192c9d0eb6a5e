"""Our own TIMESYNC exchange: MAVSDK does not tell the offset it finds."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from uasfly.link.clock import ClockMap
from uasfly.link.encode import time_request

FAST_INTERVAL_S = 0.1
SLOW_INTERVAL_S = 0.5
LARGEST_NS = 2**63
OUTSTANDING = 16  # requests whose answers are still accepted


class TimeSync:
    """Asks for the vehicle's time, matches the answers and feeds the clock map.

    Answers to other computers on the same link are left alone, as are the vehicle's own requests (tc1 = 0).
    """

    def __init__(self, clock: ClockMap) -> None:
        self._clock = clock
        self._outstanding: deque[int] = deque(maxlen=OUTSTANDING)

    @property
    def interval_s(self) -> float:
        """Time to the next request: 10 Hz until the clocks' relative pace is known and steady, then 2 Hz."""
        return SLOW_INTERVAL_S if self._clock.steady else FAST_INTERVAL_S

    def request(self, system_id: int, now_ns: int) -> str:
        """JSON of a TIMESYNC request sent at `now_ns` of the host's monotonic clock."""
        self._outstanding.append(now_ns)
        return time_request(system_id, now_ns)

    def receive(self, fields: Mapping[str, Any], arrival_s: float) -> bool:
        """Take a TIMESYNC message.

        Only TIMESYNC tells of a restart: it carries the one clock that is mapped, other messages may show stale times.

        Returns:
            Whether it shows that the vehicle has restarted.

        Raises:
            ValueError: a time is none: the clock map would not come back from it.
        """
        vehicle_ns, sent_ns = fields["tc1"], fields["ts1"]
        if not (abs(vehicle_ns) < LARGEST_NS and abs(sent_ns) < LARGEST_NS):
            raise ValueError(f"expected times of 64 bits, found {vehicle_ns} and {sent_ns}")
        if not vehicle_ns:
            return self._clock.watch(sent_ns * 1e-9)
        if sent_ns not in self._outstanding:
            return False
        self._outstanding.remove(sent_ns)
        restarted = self._clock.watch(vehicle_ns * 1e-9)
        self._clock.exchange(sent_ns * 1e-9, vehicle_ns * 1e-9, arrival_s)
        return restarted
