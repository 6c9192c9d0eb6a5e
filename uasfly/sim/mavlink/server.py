"""Runs a simulated vehicle in real time and serves it over UDP."""

from __future__ import annotations

import contextlib
import math
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from queue import SimpleQueue
from typing import Any

from uasfly.errors import UasflyError
from uasfly.sim.faults import Fault
from uasfly.sim.mavlink.channel import DEFAULT_LOCAL_PORT, DEFAULT_REMOTE, Address, UdpChannel
from uasfly.sim.mavlink.endpoint import Endpoint
from uasfly.sim.mavlink.identity import Identity
from uasfly.sim.mavlink.vehicle_protocol import Vehicle

MAX_LAG_S = 0.2  # a vehicle further behind the clock than this is put back in step
MAX_ADVANCE_S = 0.04  # simulated at a stretch, before the link is served again
LONGEST_SLEEP_S = 0.02  # less than MAX_ADVANCE_S, so that a vehicle without streams keeps pace too
DATAGRAMS_AT_ONCE = 100
CLOCK_AHEAD_STEPS = 2
BOOT_S = 1.0  # a vehicle that starts again says nothing for so long


@dataclass(slots=True)
class ServerReport:
    """What a server has done.

    Attributes:
        vehicle_s: vehicle time that has passed.
        slips: how often the vehicle fell behind the clock and was put back in step.
        slipped_s: vehicle time lost by it.
        sent: messages made (for each peer they are sent once).
        received, damaged: frames accepted and refused.
        setpoints: attitude setpoints accepted.
        processor_s: processor time used.
    """

    vehicle_s: float = 0.0
    slips: int = 0
    slipped_s: float = 0.0
    sent: int = 0
    received: int = 0
    damaged: int = 0
    setpoints: int = 0
    processor_s: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return asdict(self)


class Server:
    """A vehicle, its MAVLink endpoint, a UDP channel and a clock.

    Args:
        vehicle: the simulated vehicle; the server advances it.
        remote: host and port that telemetry goes to; whoever else talks to the local port is answered too.
        local_port: see `UdpChannel`.
        system_id: MAVLink system id; the component is 1.
        clock: seconds, monotonic.
        warn: takes one line when the vehicle first falls behind the clock.
        injected: faults that are to begin now; they may be put there from any thread.
        advanced: called after each advance with the time on `clock` at which the vehicle is where it is now.

    Raises:
        LinkError: the port is taken or the host unknown.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        remote: Address = DEFAULT_REMOTE,
        local_port: int = DEFAULT_LOCAL_PORT,
        system_id: int = 1,
        clock: Callable[[], float] = time.monotonic,
        warn: Callable[[str], None] | None = None,
        injected: SimpleQueue[Fault] | None = None,
        advanced: Callable[[float], None] | None = None,
    ) -> None:
        self._advanced = advanced
        self._identity = identity = Identity(system_id)
        self._injected = injected or SimpleQueue()
        self._vehicle = vehicle
        self._clock = clock
        self._warn = warn or _print_warning
        self.channel = UdpChannel(remote, local_port, identity, vehicle.link_faults)
        self.endpoint = Endpoint(vehicle, identity, self._now_s, time.time)
        self._boots = vehicle.boots
        self._vehicle_s = vehicle.time_s  # as it should be; its clock may jump
        self._silent_until_s = -math.inf
        self.report = ServerReport()
        self._started_s = vehicle.time_s
        self._epoch_s = clock() - vehicle.time_s

    def run(self, stopped: Callable[[], bool]) -> ServerReport:
        """Serve until `stopped` says so (asked at least 50 times a second); then close the channel."""
        processor_s = time.process_time()
        self._epoch_s = self._clock() - self._vehicle.time_s
        try:
            while not stopped():
                self.turn()
                self._sleep()
        finally:
            self.channel.close()
            self._account(time.process_time() - processor_s)
        return self.report

    def turn(self) -> None:
        """One turn of the loop: bring the vehicle up to now, take what has arrived, send what is due."""
        self._inject()
        self._advance()
        self._follow_clock()
        if self._advanced is not None:
            self._advanced(self._epoch_s + self._vehicle.time_s)
        self._receive()
        if self._clock() < self._silent_until_s:
            return
        messages = self.endpoint.poll()
        self.report.sent += len(messages)
        self.channel.broadcast(messages, self._clock())

    def _inject(self) -> None:
        while not self._injected.empty():
            try:
                self._vehicle.inject(self._injected.get())
            except UasflyError as error:
                self._warn(f"this fault cannot happen here: {error}")
        self._follow_clock()

    def _follow_clock(self) -> None:
        """The vehicle's clock may have jumped, or the vehicle may have started again."""
        jump_s, self._vehicle_s = self._vehicle.time_s - self._vehicle_s, self._vehicle.time_s
        if abs(jump_s) < 0.5 * self._vehicle.step_s:
            return
        self._epoch_s -= jump_s
        if self._vehicle.boots == self._boots:
            self.endpoint.shift(jump_s)
            return
        self._boots = self._vehicle.boots
        self._silent_until_s = self._clock() + BOOT_S
        self.endpoint = Endpoint(self._vehicle, self._identity, self._now_s, time.time)

    def _now_s(self) -> float:
        """The vehicle's clock. It runs on between steps, and waits for a vehicle that falls behind."""
        return min(self._clock() - self._epoch_s, self._vehicle.time_s + CLOCK_AHEAD_STEPS * self._vehicle.step_s)

    def _advance(self) -> None:
        vehicle = self._vehicle
        lag_s = self._clock() - self._epoch_s - vehicle.time_s
        if lag_s > MAX_LAG_S:
            self._slip(lag_s)
            return
        steps = math.floor(min(lag_s, MAX_ADVANCE_S) / vehicle.step_s + 1e-6)
        if steps > 0:
            self._vehicle_s = vehicle.time_s + steps * vehicle.step_s
            vehicle.advance_to(self._vehicle_s)

    def _slip(self, lag_s: float) -> None:
        """Let the vehicle's clock stand still for the time that this machine did not manage."""
        self._epoch_s = self._clock() - self._now_s()
        self.report.slips += 1
        self.report.slipped_s += lag_s
        if self.report.slips == 1:
            self._warn(
                f"the simulated vehicle fell {lag_s:.2f} s behind real time and goes on from there: "
                "this machine is too slow or too busy for it"
            )

    def _receive(self) -> None:
        now_s = self._clock()
        for message, address in self.channel.receive(now_s, DATAGRAMS_AT_ONCE):
            if now_s < self._silent_until_s:
                continue
            for answer in self.endpoint.receive(message):
                self.report.sent += 1
                self.channel.send(answer, address)

    def _sleep(self) -> None:
        """Wait for a datagram, or for the step at which the next message is due."""
        step_s, now_s = self._vehicle.step_s, self._clock() - self._epoch_s
        due_s = min(self.endpoint.next_due_s, now_s + LONGEST_SLEEP_S)
        wait_s = math.ceil(due_s / step_s - 1e-6) * step_s - now_s
        select.select((self.channel,), (), (), min(max(0.0, wait_s), LONGEST_SLEEP_S))

    def _account(self, processor_s: float) -> None:
        report = self.report
        report.vehicle_s = self._vehicle.time_s - self._started_s
        report.received = self.channel.frames.good
        report.damaged = self.channel.frames.bad
        report.setpoints = self.endpoint.setpoints.accepted
        report.processor_s = processor_s


def serve(
    vehicle: Vehicle,
    remote: Address = DEFAULT_REMOTE,
    local_port: int = DEFAULT_LOCAL_PORT,
    system_id: int = 1,
    stop: threading.Event | None = None,
    ready: Callable[[int], None] | None = None,
    injected: SimpleQueue[Fault] | None = None,
    advanced: Callable[[float], None] | None = None,
) -> ServerReport:
    """Serve a vehicle in real time until `stop` is set, or SIGINT or SIGTERM arrives.

    Args:
        vehicle: see `Server`.
        remote: see `Server`.
        local_port: see `UdpChannel`.
        system_id: see `Server`.
        stop: ends serving when set.
        ready: called with the local port once clients are answered.
        injected: see `Server`.
        advanced: see `Server`.

    Raises:
        LinkError: the port is taken or the host unknown.
    """
    stop = stop or threading.Event()
    server = Server(vehicle, remote, local_port, system_id, injected=injected, advanced=advanced)
    with _ended_by_signals(stop):
        if ready is not None:
            ready(server.channel.local_port)
        return server.run(stop.is_set)


@contextlib.contextmanager
def _ended_by_signals(stop: threading.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set `stop`; only the main thread may and needs to."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _print_warning(text: str) -> None:
    print(f"uasfly sim: {text}", file=sys.stderr, flush=True)
