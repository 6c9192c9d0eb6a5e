"""The MAVSDK end of the link: a real PX4, or a simulated vehicle that speaks MAVLink."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from pydantic_core import from_json

from uasfly.errors import LinkError
from uasfly.frames import swap_enu_ned
from uasfly.link.bridge import Bridge
from uasfly.link.clock import ClockMap
from uasfly.link.commands import CommandChannel
from uasfly.link.decoder import MALFORMED, Decoder
from uasfly.link.encode import attitude_target, check_setpoint, status_texts, wind_covariance
from uasfly.link.events import EchoFilter, EventFeed
from uasfly.link.finding import find_vehicle, refuse_several
from uasfly.link.inertial import taken
from uasfly.link.modes import CMD_REQUEST_MESSAGE
from uasfly.link.parameters import ParameterChannel
from uasfly.link.requests import RequestDesk
from uasfly.link.slots import Slot, WakeUp
from uasfly.link.timesync import TimeSync
from uasfly.link.upkeep import WARNING, Upkeep
from uasfly.link.urls import ConnectionUrl, parse_url
from uasfly.messages import Array, LinkEvent, LinkSample, Request, Sample, Setpoint, TextSample
from uasfly.wind_messages import WindEstimate

SETTLING_S = 1.0  # `connect` waits this long for the first time exchanges and message intervals
SETTLED_EXCHANGES = 5
LONGEST_SETPOINT_AGE_S = 0.2
HOME_POSITION_ID = 242
HOME_PATIENCE_S = 0.5

EVENTS_MIN_BAUD = 230400  # the texts of PX4's events are some 100 kB to fetch, once
KEPT = {"STATUSTEXT": 64, "HIGHRES_IMU": 32, "ODOMETRY": 16, "ATTITUDE_TARGET": 16, "DEBUG_FLOAT_ARRAY": 16}
KEPT |= {"HIL_STATE_QUATERNION": 16, "ESC_STATUS": 16}
KEPT_OTHERWISE = 4
TRUTH_MESSAGES = frozenset({"DEBUG_FLOAT_ARRAY", "HIL_STATE_QUATERNION", "GPS_GLOBAL_ORIGIN"})

_log = logging.getLogger("uasfly.link")


class MavsdkLink:
    """Link to a vehicle over any of MAVSDK's connections; satisfies `VehicleLink`. Made by `connect`.

    Everything runs in the event loop that `connect` was called in; only the slots are filled from MAVSDK's thread.
    Setpoints leave once, when `send` is called: when this process hangs, the stream stops and PX4's failsafe acts.
    """

    def __init__(self, bridge: Bridge, url: ConnectionUrl, want_truth: bool) -> None:
        self._bridge = bridge
        self._url = url
        self._closed = False
        self._awaited = False
        self._stale_setpoints = 0
        self._fresh = asyncio.Event()
        self._synchronised = asyncio.Event()
        self._clock = ClockMap()
        self._time_sync = TimeSync(self._clock)
        self._decoder = Decoder(self._clock)
        self._events = EventFeed()
        self._echoes = EchoFilter()
        self._own_samples: list[TextSample | LinkSample] = []
        self._home: asyncio.Future[Array | None] | None = None
        self._motion: asyncio.Future[bool] | None = None  # waits for the next ODOMETRY
        self._motion_came = False
        self._text_ids = itertools.cycle(range(1, 0x10000))
        self._commands = CommandChannel(bridge.send, bridge.system_id)
        self._parameters = ParameterChannel(bridge.send, bridge.system_id)
        self._desk = RequestDesk(self._commands, self._parameters, lambda: self._events.problems, self._fresh.set)
        names = [name for name in self._decoder.names if want_truth or name not in TRUTH_MESSAGES]
        self._sample_slots = {name: Slot(name, KEPT.get(name, KEPT_OTHERWISE)) for name in names}
        self._service: list[tuple[Slot, Callable[[dict[str, Any], float], None]]] = [
            (Slot("TIMESYNC", 16), self._take_time),
            (Slot("COMMAND_ACK", 16), lambda fields, _: self._commands.acknowledge(fields)),
            (Slot("PARAM_VALUE", 64), lambda fields, _: self._parameters.receive(fields)),
            (Slot("HOME_POSITION", 4), lambda fields, _: self._take_home(fields)),
        ]
        heartbeats = self._sample_slots["HEARTBEAT"]
        self._upkeep = Upkeep(bridge, url, self._time_sync, self._commands, heartbeats, want_truth, self._say)
        self._wake_up = WakeUp(asyncio.get_running_loop(), self._on_wake)
        for slot in self._sample_slots.values():
            bridge.subscribe(slot, self._ring_for_motion if slot.name == "ODOMETRY" else self._ring_if_awaited)
        for slot, _ in self._service:
            bridge.subscribe(slot, self._wake_up.ring)
        if url.scheme != "serial" or url.baud >= EVENTS_MIN_BAUD:
            bridge.subscribe_events(self._events, self._ring_if_awaited)

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
        self._serve()
        now_s = time.monotonic()
        filled = [slot for slot in self._sample_slots.values() if slot.waiting]
        waiting = [(arrival, slot.name, text) for slot in filled for arrival, text in taken(slot)]
        waiting.sort(key=_arrival)
        texts = [(text, "event") for text in self._events.take()]
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
                self._desk.hear(sample)
                samples.append(sample)
        samples.extend(self._own_samples)
        self._own_samples.clear()
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
        self._fresh.clear()
        self._awaited = True  # before the look, so that what arrives after it rings
        try:
            if self._closed or self._something_waits():
                await asyncio.sleep(0.0)
                return
            async with asyncio.timeout(timeout_s):
                await self._fresh.wait()
        except TimeoutError:
            pass
        finally:
            self._awaited = False

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Wait until the next ODOMETRY arrives, at most so long [s]; whether one has."""
        loop = asyncio.get_running_loop()
        self._motion_came = False
        motion: asyncio.Future[bool] = loop.create_future()
        self._motion = motion
        timer = loop.call_later(timeout_s, _settle, motion, False)
        try:
            return await motion
        finally:
            timer.cancel()
            self._motion = None

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
        if self._home is None or self._home.done():
            self._home = asyncio.get_running_loop().create_future()
        answer = self._home
        await self._commands.command(CMD_REQUEST_MESSAGE, (float(HOME_POSITION_ID),), repeats=1)
        await asyncio.wait((answer,), timeout=HOME_PATIENCE_S)
        return answer.result() if answer.done() else None

    async def close(self) -> None:
        """Stop everything and release the connection; idempotent. Requests under way stay unanswered."""
        if self._closed:
            return
        self._closed = True
        tasks = [*self._upkeep.cancel(), *self._desk.cancel()]
        self._bridge.close()
        self._fresh.set()
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
        return time.monotonic() - self._decoder.state.heartbeat_s

    def message_rates(self) -> dict[str, float]:
        """Rates [Hz] at which the vehicle's messages arrive, by name."""
        now_s = time.monotonic()
        return {slot.name: slot.rate_hz(now_s) for slot in self._slots()}

    def losses(self) -> dict[str, int]:
        """What was lost, by cause: unusable messages, messages that `poll` came too late for, sends that failed."""
        lost = {f"{name} unusable": count for name, count in self._decoder.dropped.items()}
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

    async def _start(self) -> None:
        self._upkeep.start()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(SETTLING_S):
                await self._upkeep.streams_asked()
                await self._synchronised.wait()
        if not self._clock.synchronised:
            self._say(WARNING, "the vehicle does not answer TIMESYNC: samples carry the time of their arrival")
        for slot in self._slots():
            slot.overrun = 0  # nobody could poll until here

    def _slots(self) -> list[Slot]:
        return [*self._sample_slots.values(), *(slot for slot, _ in self._service)]

    def _ring_if_awaited(self) -> None:
        """From MAVSDK's thread: 200 wake-ups a second would cost more than all decoding."""
        if self._awaited:
            self._wake_up.ring()

    def _ring_for_motion(self) -> None:
        """From MAVSDK's thread: a control cycle waits for this one."""
        if self._motion is not None:
            self._motion_came = True
            self._wake_up.ring()
        else:
            self._ring_if_awaited()

    def _on_wake(self) -> None:
        if self._motion is not None and self._motion_came:
            _settle(self._motion, True)
        if not self._closed:
            self._serve()
            if self._something_waits():
                self._fresh.set()

    def _serve(self) -> None:
        """Handle what does not wait for `poll`: time, acknowledgements, parameters."""
        for slot, handle in self._service:
            for arrival_s, text in slot.take() if slot.waiting else ():
                try:
                    handle(from_json(text), arrival_s)
                except MALFORMED:
                    self._decoder.dropped[slot.name] += 1

    def _take_time(self, fields: dict[str, Any], arrival_s: float) -> None:
        if self._time_sync.receive(fields, arrival_s):
            self._say(WARNING, "the vehicle has restarted; its clock and message rates are set up again")
            self._own_samples.append(LinkSample(time.monotonic(), LinkEvent.REBOOTED))
            self._upkeep.ask_for_streams()
        if self._clock.exchanges >= SETTLED_EXCHANGES:
            self._synchronised.set()

    def _take_home(self, fields: dict[str, Any]) -> None:
        if self._home is not None and not self._home.done():
            numbers = [math.nan if fields[axis] is None else float(fields[axis]) for axis in ("x", "y", "z")]
            self._home.set_result(swap_enu_ned(np.array(numbers)) if all(map(math.isfinite, numbers)) else None)

    def _something_waits(self) -> bool:
        return bool(
            self._own_samples
            or self._desk.results
            or self._events
            or any(slot.waiting for slot in self._sample_slots.values())
        )

    def _say(self, severity: int, text: str) -> None:
        _log.info("%s", text)  # no warning: that would go to a terminal on which somebody draws
        self._own_samples.append(TextSample(time.monotonic(), severity, text))
        self._fresh.set()


def _arrival(item: tuple[float, str, str]) -> float:
    return item[0]


def _settle(answer: asyncio.Future[bool], came: bool) -> None:
    if not answer.done():
        answer.set_result(came)
