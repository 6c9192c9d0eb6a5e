"""Commands to the vehicle: COMMAND_LONG with repeats until the acknowledgement comes, newest wins.

MAVSDK's own command queue is not used: it keeps repeating an old mode command after a newer one has been given, and a
result of 7 or more leaves it confused (or, in its blocking calls, aborts the process). One command of a number is under
way at a time; a newer one of the same number replaces it at once.
"""

from __future__ import annotations

import asyncio
import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from uasfly.link.encode import COMPANION, command_long

REPEAT_INTERVAL_S = 0.5
REPEATS = 4
PROGRESS_PATIENCE_S = 10.0

RESULT_ACCEPTED = 0  # MAV_RESULT
RESULT_IN_PROGRESS = 5

Send = Callable[[str, str], object]


class Ending(enum.Enum):
    """How a command ended."""

    ANSWERED = "answered"
    NO_ANSWER = "no answer"
    REPLACED = "replaced"


@dataclass(frozen=True, slots=True)
class Outcome:
    """End of a command; `result` is the MAV_RESULT where it was answered, else -1."""

    ending: Ending
    result: int = -1

    @property
    def accepted(self) -> bool:
        """Whether the vehicle has accepted the command."""
        return self.ending is Ending.ANSWERED and self.result == RESULT_ACCEPTED


class _Pending:
    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.answer: asyncio.Future[Outcome] = loop.create_future()
        self.sent_s: float | None = None
        self.in_progress = False


class CommandChannel:
    """Sends commands and matches acknowledgements; lives in the event loop.

    Args:
        send: sends one message, given its name and its JSON.
        system_id: the vehicle's, and this computer's.
        repeat_interval_s: time after which a command without an answer is sent again.
    """

    def __init__(self, send: Send, system_id: int, repeat_interval_s: float = REPEAT_INTERVAL_S) -> None:
        self._send = send
        self._system_id = system_id
        self._interval_s = repeat_interval_s
        self._pending: dict[int, _Pending] = {}
        self._owed_until_s: dict[int, float] = {}  # an abandoned command may still be answered until then
        self._loop = asyncio.get_running_loop()

    async def command(self, number: int, parameters: tuple[float, ...], repeats: int = REPEATS) -> Outcome:
        """Give a command and wait for its end; cancelling the caller stops the repeats."""
        older = self._pending.pop(number, None)
        if older is not None:
            self._abandon(number, older, Ending.REPLACED)
        pending = self._pending[number] = _Pending(self._loop)
        try:
            return await self._repeat(number, parameters, repeats, pending)
        finally:
            if self._pending.get(number) is pending:
                del self._pending[number]
                self._abandon(number, pending, Ending.NO_ANSWER)

    def acknowledge(self, fields: Mapping[str, Any]) -> None:
        """Take a COMMAND_ACK."""
        if fields["target_component"] not in {0, COMPANION} or fields["target_system"] not in {0, self._system_id}:
            return  # somebody else's
        number = fields["command"]
        if self._loop.time() < self._owed_until_s.pop(number, 0.0):
            return
        pending = self._pending.get(number)
        if pending is None or pending.answer.done() or pending.sent_s is None:
            return
        if fields["result"] == RESULT_IN_PROGRESS:
            pending.in_progress = True
        else:
            pending.answer.set_result(Outcome(Ending.ANSWERED, int(fields["result"])))

    def _abandon(self, number: int, pending: _Pending, ending: Ending) -> None:
        if pending.answer.done():
            return
        pending.answer.set_result(Outcome(ending))
        if pending.sent_s is not None:
            self._owed_until_s[number] = pending.sent_s + self._interval_s

    async def _repeat(self, number: int, parameters: tuple[float, ...], repeats: int, pending: _Pending) -> Outcome:
        for attempt in range(repeats):
            if not pending.in_progress:
                pending.sent_s = self._loop.time()
                self._send("COMMAND_LONG", command_long(self._system_id, number, parameters, attempt))
            if await self._answered(pending, self._interval_s):
                return pending.answer.result()
        while pending.in_progress:
            pending.in_progress = False
            if await self._answered(pending, PROGRESS_PATIENCE_S):
                return pending.answer.result()
        return Outcome(Ending.NO_ANSWER)

    @staticmethod
    async def _answered(pending: _Pending, timeout_s: float) -> bool:
        await asyncio.wait((pending.answer,), timeout=timeout_s)
        return pending.answer.done()
