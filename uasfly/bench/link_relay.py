"""The process that measures the link from the vehicle's side: `python -m uasfly.bench.link_relay PORT`.

A UDP relay on loopback between a vehicle and uasfly, which listens on PORT. It answers with its own port, for the
vehicle, on its standard output; when its standard input ends it prints its times as JSON. A time [ms] runs from the
moment at which an ODOMETRY leaves here for uasfly to the arrival of the setpoint that answers it.
"""

from __future__ import annotations

import json
import os
import select
import socket
import sys
import time
from collections.abc import Iterator

ODOMETRY, SET_ATTITUDE_TARGET = 331, 82
MARKER_V2, OVERHEAD_V2, SIGNATURE = 0xFD, 12, 13
BUFFER_BYTES = 65536


def message_ids(datagram: bytes) -> Iterator[int]:
    """Ids of the MAVLink 2 messages in a datagram that whole frames follow one another in."""
    start = 0
    while start + OVERHEAD_V2 <= len(datagram) and datagram[start] == MARKER_V2:
        yield int.from_bytes(datagram[start + 7 : start + 10], "little")
        start += OVERHEAD_V2 + datagram[start + 1] + (SIGNATURE if datagram[start + 2] & 1 else 0)


class RoundTrips:
    """Times from telemetry to the setpoint that answers it; fed with what passes, in either direction."""

    def __init__(self) -> None:
        self.times_ms: list[float] = []
        self._sent_s: float | None = None

    def to_program(self, datagram: bytes, now_s: float) -> None:
        """Something left for uasfly."""
        if ODOMETRY in message_ids(datagram):
            self._sent_s = now_s

    def to_vehicle(self, datagram: bytes, now_s: float) -> None:
        """Something came from uasfly; the first setpoint after motion answers it."""
        if self._sent_s is not None and SET_ATTITUDE_TARGET in message_ids(datagram):
            self.times_ms.append(1e3 * (now_s - self._sent_s))
            self._sent_s = None


def main(program_port: int) -> None:
    """Relay until standard input ends."""
    vehicle_side, program_side = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    for side in (vehicle_side, program_side):
        side.bind(("127.0.0.1", 0))
        side.setblocking(False)
    trips, program, vehicle = RoundTrips(), ("127.0.0.1", program_port), None
    print(vehicle_side.getsockname()[1], flush=True)
    while True:
        readable, _, _ = select.select((vehicle_side, program_side, sys.stdin), (), ())
        if program_side in readable:
            datagram = _received(program_side)
            if datagram is not None and vehicle is not None:
                trips.to_vehicle(datagram[0], time.perf_counter())
                vehicle_side.sendto(datagram[0], vehicle)
        if vehicle_side in readable:
            datagram = _received(vehicle_side)
            if datagram is not None:
                vehicle = datagram[1]
                trips.to_program(datagram[0], time.perf_counter())
                program_side.sendto(datagram[0], program)
        if sys.stdin in readable and not os.read(0, 4096):
            break
    print(json.dumps(trips.times_ms), flush=True)


def _received(side: socket.socket) -> tuple[bytes, tuple[str, int]] | None:
    """A datagram and who sent it; None where it was a report that nobody listens."""
    try:
        return side.recvfrom(BUFFER_BYTES)
    except OSError:
        return None


if __name__ == "__main__":
    main(int(sys.argv[1]))
