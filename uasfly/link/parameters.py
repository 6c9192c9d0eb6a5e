"""Setting one parameter of the vehicle, with read-back."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from typing import Any

from uasfly.link.encode import parameter_set

REPEAT_INTERVAL_S = 0.5
REPEATS = 4
RELATIVE_TOLERANCE = 1e-5  # the wire carries single precision

Send = Callable[[str, str], object]


class ParameterChannel:
    """Sets parameters with PARAM_SET until the vehicle reports the value back with PARAM_VALUE.

    Args:
        send: sends one message, given its name and its JSON.
        system_id: the vehicle's.
        repeat_interval_s: time after which an unanswered PARAM_SET is sent again (four times in all).
    """

    def __init__(self, send: Send, system_id: int, repeat_interval_s: float = REPEAT_INTERVAL_S) -> None:
        self._send = send
        self._system_id = system_id
        self._interval_s = repeat_interval_s
        self._waiting: dict[str, asyncio.Future[float]] = {}

    async def set(self, name: str, value: float) -> float | None:
        """Set a floating-point parameter.

        Returns:
            The value that the vehicle reports, which may differ from the one asked for; None without an answer.
        """
        answer: asyncio.Future[float] = asyncio.get_running_loop().create_future()
        self._waiting[name] = answer
        try:
            for _ in range(REPEATS):
                self._send("PARAM_SET", parameter_set(self._system_id, name, value))
                await asyncio.wait((answer,), timeout=self._interval_s)
                if answer.done():
                    return answer.result()
            return None
        finally:
            if self._waiting.get(name) is answer:
                del self._waiting[name]

    def receive(self, fields: Mapping[str, Any]) -> None:
        """Take a PARAM_VALUE."""
        answer = self._waiting.get(fields["param_id"])
        if answer is not None and not answer.done() and fields["param_value"] is not None:
            answer.set_result(float(fields["param_value"]))


def same_value(reported: float, wanted: float) -> bool:
    """Whether a value read back is the one that was set, to single precision."""
    return math.isclose(reported, wanted, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-6)
