"""Requests of the flight as commands to PX4, and PX4's answers in words for a pilot."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable

from uasfly.link.commands import CommandChannel, Ending, Outcome
from uasfly.link.modes import CMD_DO_SET_MODE, CMD_REQUEST_MESSAGE, command_of
from uasfly.link.parameters import ParameterChannel, same_value
from uasfly.messages import Request, RequestKind, RequestResult, TextSample

TAKEOFF_HEIGHT = "MIS_TAKEOFF_ALT"
HEARTBEAT_ID = 0
REASON_PATIENCE_S = 0.3  # PX4 sends its reasons about when it refuses
REASON_SEVERITY = 5  # notice and worse
REASONS = 3

_RESULT_WORDS = {
    1: "refused for now",
    2: "denied",
    3: "not supported by this vehicle",
    4: "failed",
    6: "cancelled by the vehicle",
    7: "refused: it wants COMMAND_LONG",
    8: "refused: it wants COMMAND_INT",
    9: "refused: unsupported frame",
    10: "refused: another computer is in control of the vehicle",
}

_HINTS = {
    RequestKind.ARM: "a pre-flight check fails (position estimate, battery, calibration, safety switch?)",
    RequestKind.DISARM: "PX4 disarms on the ground only",
    RequestKind.TAKEOFF: "is it armed, on the ground, with a position estimate?",
    RequestKind.OFFBOARD: "PX4 wants setpoints to arrive before it goes offboard, and an attitude estimate",
    RequestKind.HOLD: "is there a position estimate?",
    RequestKind.LAND: "is there a height estimate?",
    RequestKind.RETURN: "are the global position and the home position known?",
}


class RequestDesk:
    """Carries out requests, each in its own task; a newer request for a mode replaces an older one under way.

    Args:
        commands, parameters: channels to the vehicle.
        problems: tells what presently keeps the vehicle from arming, where it says so.
        notify: called when a result has been added.
    """

    def __init__(
        self,
        commands: CommandChannel,
        parameters: ParameterChannel,
        problems: Callable[[], tuple[str, ...]],
        notify: Callable[[], None],
    ) -> None:
        self.results: deque[RequestResult] = deque()
        self._commands = commands
        self._parameters = parameters
        self._problems = problems
        self._notify = notify
        self._tasks: set[asyncio.Task[None]] = set()
        self._mode_task: asyncio.Task[None] | None = None
        self._recent: deque[TextSample] = deque(maxlen=16)

    def start(self, request: Request) -> None:
        """Begin with a request.

        Raises:
            ValueError: when the take-off height is not a positive, finite number.
        """
        if request.kind is RequestKind.TAKEOFF and not 0.0 < request.height_m < math.inf:
            raise ValueError(f"a take-off needs a positive height, found {request.height_m} m")
        task = asyncio.get_running_loop().create_task(self._run(request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        if command_of(request.kind)[0] == CMD_DO_SET_MODE:
            if self._mode_task is not None:
                self._mode_task.cancel()
            self._mode_task = task

    def hear(self, text: TextSample) -> None:
        """Remember a status text of the vehicle: it may be the reason of a refusal."""
        self._recent.append(text)

    def cancel(self) -> list[asyncio.Task[None]]:
        """Stop every request under way; returns their tasks, to be awaited."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        return tasks

    async def _run(self, request: Request) -> None:
        begun_s = time.monotonic()
        try:
            problem = await self._carry_out(request, begun_s)
        except asyncio.CancelledError:
            self._finish(request, "replaced by a newer request")
            raise
        self._finish(request, problem)
        if not problem:  # do not wait up to a second for the next heartbeat to see its effect
            await self._commands.command(CMD_REQUEST_MESSAGE, (HEARTBEAT_ID,), repeats=1)

    async def _carry_out(self, request: Request, begun_s: float) -> str:
        """Returns what went wrong, "" when the vehicle has accepted."""
        if request.kind is RequestKind.TAKEOFF:
            reported = await self._parameters.set(TAKEOFF_HEIGHT, request.height_m)
            if reported is None:
                return f"take-off not begun: the vehicle did not confirm the height ({TAKEOFF_HEIGHT})"
            if not same_value(reported, request.height_m):
                return (
                    f"take-off not begun: the vehicle keeps {TAKEOFF_HEIGHT} at {reported:g} m, "
                    f"asked for {request.height_m:g} m"
                )
        outcome = await self._commands.command(*command_of(request.kind))
        if outcome.accepted:
            return ""
        if outcome.ending is not Ending.ANSWERED:
            return explain(request.kind, outcome, [])
        await asyncio.sleep(REASON_PATIENCE_S)
        reasons = [text.text for text in self._recent if text.time_s >= begun_s and text.severity <= REASON_SEVERITY]
        return explain(request.kind, outcome, [*reasons[-REASONS:], *self._problems()])

    def _finish(self, request: Request, problem: str) -> None:
        self.results.append(RequestResult(time.monotonic(), request, not problem, problem))
        self._notify()


def explain(kind: RequestKind, outcome: Outcome, reasons: list[str]) -> str:
    """Why a request was not accepted, in words for a pilot.

    Args:
        kind: what was asked for.
        outcome: how the command ended.
        reasons: what the vehicle itself has said about it; it replaces the usual reason.
    """
    name = kind.value
    if outcome.ending is Ending.NO_ANSWER:
        return f"{name}: no answer from the vehicle (is the link good, does it still send heartbeats?)"
    if outcome.ending is Ending.REPLACED:
        return f"{name}: replaced by a newer request"
    words = _RESULT_WORDS.get(outcome.result, f"refused with result {outcome.result}")
    if outcome.result == 3:
        return f"{name}: {words}"
    said = "; ".join(dict.fromkeys(reasons))
    return f'{name} {words}: the vehicle says "{said}"' if said else f"{name} {words}: {_HINTS[kind]}"
