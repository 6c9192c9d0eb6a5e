"""What keeps a link alive beside the samples: time exchange, message rates, watching the heartbeat."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Coroutine, Mapping
from typing import Any

from uasfly.errors import LinkError
from uasfly.link.bridge import Bridge
from uasfly.link.clock import ClockMap
from uasfly.link.commands import CommandChannel
from uasfly.link.inbox import Inbox
from uasfly.link.ports import DeviceWatch, check_available
from uasfly.link.streams import ask_for_streams
from uasfly.link.timesync import TimeSync
from uasfly.link.urls import ConnectionUrl
from uasfly.messages import LinkEvent, LinkSample

SETTLING_S = 1.0  # `settled` waits this long for the first time exchanges and message intervals
SETTLED_EXCHANGES = 5
SILENCE_S = 3.0  # PX4 sends a heartbeat every second
REOPEN_INTERVAL_S = 2.0
WARNING, NOTICE = 4, 5  # MAVLink severities

_log = logging.getLogger("uasfly.link")


class Upkeep:
    """Background tasks of a link.

    Args:
        bridge, url: the connection.
        clock: the clock map that the time exchange feeds.
        commands: channel for the message intervals.
        inbox: where the heartbeats go through, and where the pilot finds what is announced.
        want_truth: whether to ask for the true state too.
    """

    def __init__(
        self,
        bridge: Bridge,
        url: ConnectionUrl,
        clock: ClockMap,
        commands: CommandChannel,
        inbox: Inbox,
        want_truth: bool,
    ) -> None:
        self._bridge = bridge
        self._url = url
        self._clock = clock
        self._time_sync = TimeSync(clock)
        self._synchronised = asyncio.Event()
        self._commands = commands
        self._inbox = inbox
        self._heartbeats = inbox.slots["HEARTBEAT"]
        self._want_truth = want_truth
        self._device = DeviceWatch(url.device) if url.scheme == "serial" else None
        self._tasks: set[asyncio.Task[None]] = set()
        self._stream_task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start all tasks."""
        self._spawn(self._keep_time())
        self._spawn(self._watch_heartbeat())
        self.ask_for_streams()

    def ask_for_streams(self) -> None:
        """Set the message intervals (again): a vehicle that has restarted has forgotten them."""
        if self._stream_task is not None:
            self._stream_task.cancel()
        self._stream_task = self._spawn(self._stream())

    async def settled(self) -> None:
        """Wait until all message intervals have been asked for and the clocks are synchronised, at most 1 s."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(SETTLING_S):
                if self._stream_task is not None:
                    await asyncio.wait((self._stream_task,))
                await self._synchronised.wait()
        if not self._clock.synchronised:
            self._inbox.say(WARNING, "the vehicle does not answer TIMESYNC: samples carry the time of their arrival")

    def take_time(self, fields: Mapping[str, Any], arrival_s: float) -> None:
        """Take a TIMESYNC; a vehicle that has restarted is announced and set up again."""
        if self._time_sync.receive(fields, arrival_s):
            self._inbox.say(WARNING, "the vehicle has restarted; its clock and message rates are set up again")
            self._inbox.add(LinkSample(time.monotonic(), LinkEvent.REBOOTED))
            self.ask_for_streams()
        if self._clock.exchanges >= SETTLED_EXCHANGES:
            self._synchronised.set()

    def cancel(self) -> list[asyncio.Task[None]]:
        """Stop all tasks; returns them, to be awaited."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        return tasks

    def _spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _stream(self) -> None:
        for problem in await ask_for_streams(self._commands, self._want_truth, narrow=self._device is not None):
            self._inbox.say(WARNING, problem)

    async def _keep_time(self) -> None:
        while True:
            self._bridge.send("TIMESYNC", self._time_sync.request(self._bridge.system_id, time.monotonic_ns()))
            await asyncio.sleep(self._time_sync.interval_s)

    async def _watch_heartbeat(self) -> None:
        """Announce silence and its end; bring a serial port back."""
        while True:
            received = self._heartbeats.received
            await asyncio.sleep(SILENCE_S)
            if self._heartbeats.received != received:
                continue
            self._inbox.say(WARNING, f"no heartbeat from the vehicle for {SILENCE_S:g} s")
            await self._until_heartbeat(received)
            self._inbox.say(NOTICE, "the vehicle's heartbeat is back")
            self.ask_for_streams()

    async def _until_heartbeat(self, received: int) -> None:
        since_reopening_s = 0.0
        step_s = 0.1
        while self._heartbeats.received == received:
            if self._device is not None and self._device.replaced() and since_reopening_s <= 0.0:
                since_reopening_s = REOPEN_INTERVAL_S
                self._reopen(self._device)
            await asyncio.sleep(step_s)
            since_reopening_s -= step_s

    def _reopen(self, device: DeviceWatch) -> None:
        try:
            check_available(self._url)
            self._bridge.reopen()
            device.opened()
        except LinkError as error:
            _log.debug("%s", error)
