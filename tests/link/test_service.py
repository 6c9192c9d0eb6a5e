"""Messages that the link uses itself."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

from uasfly.link.service import Service


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"tc1": null}'])
def test_a_message_that_cannot_be_used_is_counted_and_ends_nothing(text: str) -> None:
    """The ones after it are handled, of its own type and of others, with their arrival."""
    dropped: Counter[str] = Counter()
    times: list[tuple[int, float]] = []
    parameters: list[dict[str, Any]] = []
    service = Service(
        {
            "TIMESYNC": lambda fields, arrival_s: times.append((fields["tc1"] + 1, arrival_s)),
            "PARAM_VALUE": lambda fields, _: parameters.append(fields),
        },
        dropped,
    )
    time_slot, parameter_slot = service.slots
    time_slot.put(1.0, text)
    time_slot.put(2.0, '{"tc1": 6}')
    parameter_slot.put(3.0, '{"param_id": "A"}')
    service.serve()
    assert dropped == {"TIMESYNC": 1}
    assert times == [(7, 2.0)]
    assert parameters == [{"param_id": "A"}]
    service.serve()
    assert len(times) == 1
