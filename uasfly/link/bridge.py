"""The one module that touches MAVSDK: its instance, its connection, raw messages in and out.

The synchronous API with callbacks is used, because the stock asyncio wrapper queues without bound and cannot be left
while a command waits. Callbacks run in MAVSDK's thread: they stamp the arrival, put the JSON into a slot and ring.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from mavsdk import Autopilot, ComponentType, Configuration, Mavsdk, System
from mavsdk.exceptions import ConnectionError as MavsdkConnectionError
from mavsdk.logging import LogCallback, _cmavsdk_lib
from mavsdk.plugins.events import Event, Events, HealthAndArmingCheckReport
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkDirectError, MavlinkMessage

from uasfly.errors import LinkError
from uasfly.link.encode import AUTOPILOT
from uasfly.link.events import EventFeed
from uasfly.link.slots import Slot

SEARCH_INTERVAL_S = 0.05
KINDS_PATIENCE_S = 1.0
DESTROY_PATIENCE_S = 0.25
PX4 = Autopilot.PX4.name
ARDUPILOT = Autopilot.ARDUPILOT.name
GENERIC = Autopilot.GENERIC.name

_log = logging.getLogger("uasfly.link.mavsdk")


@dataclass(frozen=True, slots=True)
class HeardSystem:
    """A system on the link: `autopilot` is None where it has none (a ground station, a gimbal)."""

    system_id: int
    autopilot: str | None

    def __str__(self) -> str:
        return f"{self.system_id} ({self.autopilot or 'no autopilot'})"


class Bridge:
    """One MAVSDK instance with one connection; nothing of it is used after `close`.

    Args:
        url: connection as MAVSDK understands it.
        system_id: MAVLink system id of this computer, the vehicle's own: PX4 relays texts of its own system only.

    Raises:
        LinkError: when the connection cannot be opened.
    """

    def __init__(self, url: str, system_id: int) -> None:
        configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
        configuration.system_id = system_id
        self._url = url
        self._mavsdk = Mavsdk(configuration)
        self._direct: MavlinkDirect | None = None
        self._events: Events | None = None
        self._system: System | None = None
        self._connection: object | None = None
        self._closed = False
        self.send_errors = 0
        try:
            self._connection = self._mavsdk.add_any_connection_with_handle(url)
        except MavsdkConnectionError as error:
            self.close()
            raise LinkError(f"{url}: MAVSDK cannot open this connection ({error})") from error

    async def find(self, system_id: int | None, timeout_s: float) -> list[HeardSystem]:
        """Wait until a vehicle with PX4 is heard and attach to it.

        Args:
            system_id: the vehicle wanted, None for the first one heard.
            timeout_s: how long to wait; it ends at once where the vehicle wanted has another autopilot.

        Returns:
            The systems heard, the attached one first (if any, see `attached`).
        """
        deadline = time.monotonic() + timeout_s
        while True:
            systems = self._mavsdk.get_systems()
            heard = [_describe(system) for system in systems]
            for system, description in zip(systems, heard, strict=True):
                if description.autopilot == PX4 and system_id in {None, description.system_id}:
                    self._attach(system)
                    heard = await self._kinds_known()
                    return [description, *(other for other in heard if other.system_id != description.system_id)]
            foreign = any(other.autopilot == ARDUPILOT and system_id in {None, other.system_id} for other in heard)
            if foreign or time.monotonic() >= deadline:  # other types may still turn out to be PX4
                return heard
            await asyncio.sleep(SEARCH_INTERVAL_S)

    async def _kinds_known(self) -> list[HeardSystem]:
        """The systems heard, as soon as MAVSDK knows what they are: at first it calls every autopilot generic."""
        deadline = time.monotonic() + KINDS_PATIENCE_S
        while True:
            heard = self.heard()
            if time.monotonic() >= deadline or all(system.autopilot != GENERIC for system in heard):
                return heard
            await asyncio.sleep(SEARCH_INTERVAL_S)

    def heard(self) -> list[HeardSystem]:
        """The systems heard so far, in the order of their ids."""
        return sorted(map(_describe, self._mavsdk.get_systems()), key=lambda system: system.system_id)

    @property
    def attached(self) -> bool:
        """Whether `find` has found its vehicle."""
        return self._direct is not None

    @property
    def system_id(self) -> int:
        """The attached vehicle's MAVLink system id."""
        return self._system_id

    def subscribe(self, slot: Slot, ring: Callable[[], None]) -> None:
        """Let the autopilot's messages of the slot's name flow into the slot, each followed by `ring`."""
        assert self._direct is not None
        system_id, put, now = self._system_id, slot.put, time.monotonic

        def receive(message: MavlinkMessage, _: object) -> None:
            if message.component_id == AUTOPILOT and message.system_id == system_id:
                put(now(), message.fields_json)
                ring()

        self._direct.subscribe_message(slot.name, receive)

    def subscribe_events(self, feed: EventFeed, ring: Callable[[], None]) -> None:
        """Let the vehicle's events flow into `feed`; MAVSDK fetches their texts from the vehicle and keeps them."""
        now = time.monotonic
        self._events = Events(self._system)

        def receive(event: Event, _: object) -> None:
            if event.compid == AUTOPILOT and event.message:
                feed.add(now(), int(event.log_level), event.message)
                ring()

        def check(report: HealthAndArmingCheckReport, _: object) -> None:
            mode = report.current_mode_intention
            problems = () if mode.can_arm_or_run else tuple(problem.message for problem in mode.problems)
            feed.set_problems(problems)

        self._events.subscribe_events(receive)
        self._events.subscribe_health_and_arming_checks(check)

    def send(self, name: str, fields: str) -> bool:
        """Send one message, once.

        Returns:
            Whether MAVSDK took it; a broken connection is counted in `send_errors`.

        Raises:
            LinkError: after `close`.
        """
        if self._closed or self._direct is None:
            raise LinkError(f"{self._url}: the link is closed")
        try:
            self._direct.send_message(MavlinkMessage(name, 0, 0, self._system_id, AUTOPILOT, fields))
        except MavlinkDirectError as error:
            self.send_errors += 1
            _log.debug("%s was not sent: %s", name, error.result.name)
            return False
        return True

    def reopen(self) -> None:
        """Open the serial port anew: one that went away does not come back by itself.

        The dead connection stays: MAVSDK 4.1 crashes now and then when a serial one is removed (the end of its pending
        read is handled after the object is gone).

        Raises:
            LinkError: when it cannot be opened (yet).
        """
        try:
            self._connection = self._mavsdk.add_any_connection_with_handle(self._url)
        except MavsdkConnectionError as error:
            raise LinkError(f"{self._url}: MAVSDK cannot open this connection ({error})") from error

    def close(self) -> None:
        """Destroy the MAVSDK instance; takes some milliseconds. Idempotent.

        MAVSDK waits for a download of event texts to end, which may take minutes where PX4 names a server that hangs.
        Then the port is given back here, and the rest is left to a thread that does not hold up the end of the process.
        """
        if self._closed:
            return
        self._closed = True
        self._direct = self._events = self._system = None
        if self._connection is not None and not self._url.startswith("serial"):  # see `reopen`
            self._mavsdk.remove_connection(self._connection)
        destroyer = threading.Thread(target=self._mavsdk.destroy, name="mavsdk-destroy", daemon=True)
        destroyer.start()
        destroyer.join(DESTROY_PATIENCE_S)

    def _attach(self, system: System) -> None:
        self._system, self._system_id = system, int(system.get_system_id())
        self._direct = MavlinkDirect(system)


def _describe(system: System) -> HeardSystem:
    autopilot = Autopilot(system.autopilot_type()).name if system.has_autopilot() else None
    return HeardSystem(int(system.get_system_id()), autopilot)


def _to_logging(level: int, message: bytes | None, _file: bytes | None, _line: int, _user: object) -> bool:
    _log.debug("%s", (message or b"").decode(errors="replace"), extra={"mavsdk_level": level})
    return True  # nothing of it goes to the terminal by itself


# Not by `mavsdk.log_subscribe`, which takes every text for UTF-8: a status text with another byte in it would go to the
# terminal as it is, with an error before it. The object must live as long as MAVSDK may call it.
_LOG_CALLBACK = LogCallback(_to_logging)
_cmavsdk_lib.mavsdk_log_subscribe(_LOG_CALLBACK, None)
