"""Messages that the link uses itself and that do not wait for `poll`: time, acknowledgements, parameters, home."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from pydantic_core import from_json

from uasfly.link.decoder import MALFORMED
from uasfly.link.slots import Slot

KEPT = {"PARAM_VALUE": 64, "HOME_POSITION": 4}
KEPT_OTHERWISE = 16

Handler = Callable[[dict[str, Any], float], object]  # fields of a message, arrival


class Service:
    """Hands messages to those that asked for them. MAVSDK's thread fills the slots, the event loop serves.

    Args:
        handlers: by the name of the message, in the order in which they are served.
        dropped: counts the messages of each type that could not be used.
    """

    def __init__(self, handlers: Mapping[str, Handler], dropped: Counter[str]) -> None:
        self._served = [(Slot(name, KEPT.get(name, KEPT_OTHERWISE)), handle) for name, handle in handlers.items()]
        self._dropped = dropped

    @property
    def slots(self) -> list[Slot]:
        """The slots to be filled."""
        return [slot for slot, _ in self._served]

    def serve(self) -> None:
        """Handle all that has come."""
        for slot, handle in self._served:
            for arrival_s, text in slot.take() if slot.waiting else ():
                try:
                    handle(from_json(text), arrival_s)
                except MALFORMED:
                    self._dropped[slot.name] += 1
