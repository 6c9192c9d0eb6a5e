"""Keeps account of what was asked of the vehicle, one request at a time, and of what it has granted."""

from __future__ import annotations

from uasfly.messages import Request, RequestKind, RequestResult

ANSWER_TIMEOUT_S = 5.0


class Asking:
    """Requests of one phase.

    Attributes:
        accepted: kinds that were granted since the phase began.
        refused: how often each kind was refused since then.
    """

    def __init__(self) -> None:
        self.accepted: set[RequestKind] = set()
        self.refused: dict[RequestKind, int] = {}
        self._waiting: Request | None = None
        self._asked_s = 0.0

    def reset(self, time_s: float, retry_s: float) -> None:
        """A new phase: nothing is asked, and something may be at once."""
        self.accepted.clear()
        self.refused.clear()
        self._waiting, self._asked_s = None, time_s - retry_s

    def ask(self, time_s: float, request: Request, requests: list[Request]) -> None:
        """Put a request to the vehicle."""
        self._waiting, self._asked_s = request, time_s
        requests.append(request)

    def may_ask(self, time_s: float, pause_s: float) -> bool:
        """Whether nothing is awaited, and the last request is longer ago than `pause_s`."""
        return self._waiting is None and time_s - self._asked_s > pause_s

    def answers(self, time_s: float, results: list[RequestResult]) -> list[RequestResult]:
        """The answers among these that were waited for; one that never comes is a refusal."""
        found = [answer for result in results if (answer := self._taken(result)) is not None]
        if self._waiting is not None and time_s - self._asked_s > ANSWER_TIMEOUT_S:
            silent = RequestResult(time_s, self._waiting, accepted=False, text="no answer")
            found += [answer for answer in (self._taken(silent),) if answer is not None]
        return found

    def _taken(self, result: RequestResult) -> RequestResult | None:
        kind = result.request.kind
        if self._waiting is None or kind is not self._waiting.kind:
            return None
        self._waiting = None
        if result.accepted:
            self.accepted.add(kind)
        else:
            self.refused[kind] = self.refused.get(kind, 0) + 1
        return result
