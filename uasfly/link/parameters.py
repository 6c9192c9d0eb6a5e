"""Reading and setting parameters of the vehicle, by name."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from uasfly.link.encode import parameter_request, parameter_set

REPEAT_INTERVAL_S = 0.5
REPEATS = 4
READ_INTERVAL_S = 0.4  # an unknown name costs READS of these: PX4 answers it with a message that MAVSDK does not know
READS = 3
READS_IN_FLIGHT = 8
RELATIVE_TOLERANCE = 1e-5  # the wire carries single precision

_INTEGERS = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i"}  # MAV_PARAM_TYPE: layout of the first bytes

Send = Callable[[str, str], object]
Answer = asyncio.Future[float]


class ParameterChannel:
    """Reads parameters with PARAM_REQUEST_READ, and sets them with PARAM_SET until PARAM_VALUE reports them back.

    Args:
        send: sends one message, given its name and its JSON.
        system_id: the vehicle's.
        repeat_interval_s: time after which an unanswered PARAM_SET is sent again (four times in all).
        read_interval_s: the same for a PARAM_REQUEST_READ (three times in all).
    """

    def __init__(
        self,
        send: Send,
        system_id: int,
        repeat_interval_s: float = REPEAT_INTERVAL_S,
        read_interval_s: float = READ_INTERVAL_S,
    ) -> None:
        self._send = send
        self._system_id = system_id
        self._interval_s = repeat_interval_s
        self._read_interval_s = read_interval_s
        self._waiting: dict[str, list[Answer]] = {}

    async def set(self, name: str, value: float) -> float | None:
        """Set a floating-point parameter.

        Returns:
            The value that the vehicle reports, which may differ from the one asked for; None without an answer.
        """
        message = parameter_set(self._system_id, name, value)
        return await self._ask(name, "PARAM_SET", message, self._interval_s, REPEATS)

    async def read(self, names: Iterable[str]) -> dict[str, float | None]:
        """Read parameters, several at a time.

        Returns:
            Values by name, integers as floats; None without an answer (mostly: the vehicle has no such parameter) and
            for an integer that cannot be read because its bytes are no number as a float (some negative ones).
        """
        gate = asyncio.Semaphore(READS_IN_FLIGHT)

        async def one(name: str) -> float | None:
            async with gate:
                message = parameter_request(self._system_id, name)
                return await self._ask(name, "PARAM_REQUEST_READ", message, self._read_interval_s, READS)

        wanted = list(dict.fromkeys(names))
        return dict(zip(wanted, await asyncio.gather(*map(one, wanted)), strict=True))

    def receive(self, fields: Mapping[str, Any]) -> None:
        """Take a PARAM_VALUE; one without a readable value is no answer."""
        waiting = self._waiting.get(fields["param_id"], ())
        value = parameter_value(fields) if waiting else None
        for answer in waiting:
            if value is not None and not answer.done():
                answer.set_result(value)

    async def _ask(self, name: str, kind: str, message: str, interval_s: float, repeats: int) -> float | None:
        answer: Answer = asyncio.get_running_loop().create_future()
        waiting = self._waiting.setdefault(name, [])
        waiting.append(answer)
        try:
            for _ in range(repeats):
                self._send(kind, message)
                await asyncio.wait((answer,), timeout=interval_s)
                if answer.done():
                    return answer.result()
            return None
        finally:
            waiting.remove(answer)
            if not waiting:
                del self._waiting[name]


def parameter_value(fields: Mapping[str, Any]) -> float | None:
    """Value of a PARAM_VALUE; PX4 puts the bytes of an integer into the float field, so the type tells how to read it.

    Returns:
        None where the float field is no number: not a number at all, or the bytes of an integer that read like that.
    """
    content = fields["param_value"]
    if content is None or not math.isfinite(content):
        return None
    layout = _INTEGERS.get(int(fields.get("param_type", 0)))
    if layout is None:
        return float(content)
    return float(struct.unpack_from(layout, struct.pack("<f", content))[0])


def same_value(reported: float, wanted: float) -> bool:
    """Whether a value read back is the one that was set, to single precision."""
    return math.isclose(reported, wanted, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-6)
