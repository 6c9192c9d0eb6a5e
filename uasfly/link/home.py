"""The vehicle's home position, which PX4 tells when it is asked for it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from uasfly.frames import swap_enu_ned
from uasfly.link.commands import CommandChannel
from uasfly.link.modes import CMD_REQUEST_MESSAGE
from uasfly.messages import Array

HOME_POSITION_ID = 242
PATIENCE_S = 0.5


class HomeChannel:
    """Asks for HOME_POSITION; questions at the same time share the answer.

    Args:
        commands: channel for the question.
    """

    def __init__(self, commands: CommandChannel) -> None:
        self._commands = commands
        self._answer: asyncio.Future[Array | None] | None = None

    async def read(self) -> Array | None:
        """Home in PX4's local frame, (3,) m, ENU; None where PX4 has none or does not tell within half a second."""
        if self._answer is None or self._answer.done():
            self._answer = asyncio.get_running_loop().create_future()
        answer = self._answer
        await self._commands.command(CMD_REQUEST_MESSAGE, (float(HOME_POSITION_ID),), repeats=1)
        await asyncio.wait((answer,), timeout=PATIENCE_S)
        return answer.result() if answer.done() else None

    def receive(self, fields: Mapping[str, Any]) -> None:
        """Take a HOME_POSITION; one that nobody has asked for is left alone."""
        if self._answer is not None and not self._answer.done():
            numbers = [math.nan if fields[axis] is None else float(fields[axis]) for axis in ("x", "y", "z")]
            self._answer.set_result(swap_enu_ned(np.array(numbers)) if all(map(math.isfinite, numbers)) else None)
