"""The MAVSDK end of the link: a real PX4, or a simulated vehicle that speaks MAVLink."""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import Iterable

from uasfly.errors import LinkError
from uasfly.link.bridge import Bridge
from uasfly.link.clock import ClockMap
from uasfly.link.commands import CommandChannel
from uasfly.link.encode import attitude_target, check_setpoint, status_texts, wind_covariance
from uasfly.link.finding import find_vehicle, refuse_several
from uasfly.link.home import HomeChannel
from uasfly.link.inbox import Inbox
from uasfly.link.parameters import ParameterChannel
from uasfly.link.requests import RequestDesk
from uasfly.link.service import Service
from uasfly.link.slots import Slot
from uasfly.link.upkeep import Upkeep
from uasfly.link.urls import ConnectionUrl, parse_url
from uasfly.link.waiting import Waiting
from uasfly.messages import Array, Request, Sample, Setpoint
from uasfly.wind_messages import WindEstimate

LONGEST_SETPOINT_AGE_S = 0.15  # on the wire it is younger than 0.2 s, whatever MAVSDK and the system take
EVENTS_MIN_BAUD = 230400  # the texts of PX4's events are some 100 kB to fetch, once


class MavsdkLink:
    """Link to a vehicle over any of MAVSDK's connections; satisfies `VehicleLink`. Made by `connect`.

    Everything runs in the event loop that `connect` was called in; only the slots are filled from MAVSDK's thread.
    Setpoints leave once, when `send` is called: when this process hangs, the stream stops and PX4's failsafe acts.
    """

    def __init__(self, bridge: Bridge, url: ConnectionUrl, want_truth: bool) -> None:
        self._bridge = bridge
        self._url = url
        self._closed = False
        self._stale_setpoints = 0
        self._text_ids = itertools.cycle(range(1, 0x10000))
        fresh = asyncio.Event()
        self._clock = ClockMap()
        self._commands = CommandChannel(bridge.send, bridge.system_id)
        self._parameters = ParameterChannel(bridge.send, bridge.system_id)
        self._home = HomeChannel(self._commands)
        self._desk = RequestDesk(self._commands, self._parameters, lambda: self._inbox.events.problems, fresh.set)
        self._inbox = Inbox(self._clock, want_truth, self._desk.hear, fresh.set)
        self._upkeep = Upkeep(bridge, url, self._clock, self._commands, self._inbox, want_truth)
        self._service = Service(
            {
                "TIMESYNC": self._upkeep.take_time,
                "COMMAND_ACK": lambda fields, _: self._commands.acknowledge(fields),
                "PARAM_VALUE": lambda fields, _: self._parameters.receive(fields),
                "HOME_POSITION": lambda fields, _: self._home.receive(fields),
            },
            self._inbox.dropped,
        )
        self._waiting = Waiting(fresh, self._service.serve, self._something_waits)
        self._subscribe()

    @classmethod
    async def connect(
        cls,
        url: str,
        *,
        system_id: int | None = None,
        timeout_s: float = 10.0,
        want_truth: bool = False,
        listen_s: float = 0.0,
    ) -> MavsdkLink:
        """Open a connection, find the vehicle, start the time exchange and set the message rates.

        Args:
            url: see `urls.ACCEPTED_FORMS`.
            system_id: the vehicle's MAVLink system id; None takes the only vehicle heard.
            timeout_s: how long to wait for the vehicle.
            want_truth: also ask for the true state, where the vehicle is a simulation.
            listen_s: without a system_id, how long a second vehicle is listened for (a heartbeat comes every second);
                most of it passes while the link is set up.

        Raises:
            LinkError: for a URL of no accepted form, a busy port, no vehicle, several vehicles and no system id,
                another system id than the one wanted, an autopilot that is not PX4. The text says what to check.
        """
        bridge, numeric_url, heard = await find_vehicle(parse_url(url), system_id, timeout_s)
        link = None
        try:
            link = cls(bridge, numeric_url, want_truth)
            found_s = time.monotonic()
            if system_id is None:
                refuse_several(numeric_url, heard)
            await link._start()
            if system_id is None:
                await asyncio.sleep(max(0.0, found_s + listen_s - time.monotonic()))
                refuse_several(numeric_url, bridge.heard())
        except BaseException:
            await link.close() if link else bridge.close()
            raise
        return link

    def poll(self) -> tuple[Sample, ...]:
        """Samples that have arrived since the last call; never blocks. Empty once closed.

        Motion and state come first, then texts, then answers to requests; each group in the order of arrival.
        """
        if self._closed:
            return ()
        self._service.serve()
        samples = self._inbox.take()
        while self._desk.results:
            samples.append(self._desk.results.popleft())
        return tuple(samples)

    def send(self, setpoint: Setpoint) -> bool:
        """Send one setpoint, once: attitude, thrust and yaw rate as feed-forward.

        Returns:
            False where it was made longer than LONGEST_SETPOINT_AGE_S ago: it stays here, counted in `losses`. A
            program that was stopped in the middle of a cycle must not begin with what it was about to say then.

        Raises:
            ValueError: when a field is not finite or the thrust is outside 0..1: such a setpoint never leaves.
            LinkError: after `close`.
        """
        if self._closed:
            check_setpoint(setpoint)
            raise LinkError(f"{self._url}: the link is closed")
        vehicle_s = self._clock.to_vehicle(setpoint.time_s)
        fields = attitude_target(setpoint, self._bridge.system_id, vehicle_s)
        if time.monotonic() - setpoint.time_s > LONGEST_SETPOINT_AGE_S:
            self._stale_setpoints += 1
            return False
        self._bridge.send("SET_ATTITUDE_TARGET", fields)
        return True

    def request(self, request: Request) -> None:
        """Ask the vehicle for something; the answer comes as a RequestResult in a later `poll`.

        Raises:
            ValueError: for a take-off height that is not positive.
            LinkError: after `close`.
        """
        if self._closed:
            raise LinkError(f"{self._url}: the link is closed")
        self._desk.start(request)

    async def wait(self, timeout_s: float) -> None:
        """Wait until something new is there for `poll`, or until the time-out [s]."""
        await self._waiting.wait(timeout_s)

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Wait until the next ODOMETRY arrives, at most so long [s]; whether one has."""
        return await self._waiting.wait_for_motion(timeout_s)

    def send_text(self, severity: int, text: str) -> None:
        """Send a status text; PX4 relays it to the ground station.

        Args:
            severity: 0 emergency .. 7 debug.
            text: of any length; beyond 50 characters it goes in chunks.

        Raises:
            ValueError: for a severity outside 0..7.
            LinkError: after `close`.
        """
        for fields in status_texts(severity, text, next(self._text_ids)):
            self._bridge.send("STATUSTEXT", fields)

    def send_wind(self, wind: WindEstimate) -> None:
        """Send the mean wind as WIND_COV; PX4 forwards it to the ground station.

        Raises:
            ValueError: when it is not finite.
            LinkError: after `close`.
        """
        self._bridge.send("WIND_COV", wind_covariance(wind, self._clock.to_vehicle(wind.time_s)))

    async def read_parameters(self, names: Iterable[str]) -> dict[str, float | None]:
        """Parameters of the vehicle by name; None for one that it does not have, or does not tell within 1.2 s.

        Raises:
            LinkError: after `close`.
        """
        return await self._parameters.read(names)

    async def home(self) -> Array | None:
        """Home in PX4's local frame, (3,) m, ENU; None where PX4 has none or does not tell within half a second."""
        return await self._home.read()

    async def close(self) -> None:
        """Stop everything and release the connection; idempotent. Requests under way stay unanswered."""
        if self._closed:
            return
        self._closed = True
        self._waiting.close()
        tasks = [*self._upkeep.cancel(), *self._desk.cancel()]
        self._bridge.close()
        await asyncio.gather(*tasks, return_exceptions=True)

    @property
    def system_id(self) -> int:
        """MAVLink system id of the vehicle."""
        return self._bridge.system_id

    @property
    def clock_offset(self) -> float | None:
        """Host time minus vehicle time [s]; None before the first TIMESYNC answer: samples carry arrival times."""
        return self._clock.offset_s

    @property
    def round_trip_s(self) -> float:
        """Smallest recent TIMESYNC round trip [s]; NaN before the first answer."""
        return self._clock.round_trip_s

    @property
    def heartbeat_age_s(self) -> float:
        """Time since the vehicle's last heartbeat that `poll` has seen [s]; NaN before the first."""
        return time.monotonic() - self._inbox.heartbeat_s

    def message_rates(self) -> dict[str, float]:
        """Rates [Hz] at which the vehicle's messages arrive, by name."""
        now_s = time.monotonic()
        return {slot.name: slot.rate_hz(now_s) for slot in self._slots()}

    def losses(self) -> dict[str, int]:
        """What was lost, by cause: unusable messages, messages that `poll` came too late for, sends that failed."""
        lost = {f"{name} unusable": count for name, count in self._inbox.dropped.items()}
        lost.update({f"{slot.name} overrun": slot.overrun for slot in self._slots() if slot.overrun})
        if self._stale_setpoints:
            lost["stale setpoints"] = self._stale_setpoints
        if self._bridge.send_errors:
            lost["send errors"] = self._bridge.send_errors
        return lost

    async def __aenter__(self) -> MavsdkLink:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def _subscribe(self) -> None:
        waiting = self._waiting
        for slot in self._inbox.slots.values():
            ring = waiting.ring_for_motion if slot.name == "ODOMETRY" else waiting.ring_if_awaited
            self._bridge.subscribe(slot, ring)
        for slot in self._service.slots:
            self._bridge.subscribe(slot, waiting.ring)
        if self._url.scheme != "serial" or self._url.baud >= EVENTS_MIN_BAUD:
            self._bridge.subscribe_events(self._inbox.events, waiting.ring_if_awaited)

    async def _start(self) -> None:
        self._upkeep.start()
        await self._upkeep.settled()
        for slot in self._slots():
            slot.overrun = 0  # nobody could poll until here

    def _slots(self) -> list[Slot]:
        return [*self._inbox.slots.values(), *self._service.slots]

    def _something_waits(self) -> bool:
        return bool(self._desk.results or self._inbox)
