"""ESC_STATUS: messages of four rotors become samples."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from uasfly.link.clock import ClockMap
from uasfly.link.decoder import Decoder
from uasfly.messages import RotorSample, Sample

RAD_S = 2.0 * math.pi / 60.0


def batch(time_s: float, index: int, rpm: list[Any]) -> dict[str, Any]:
    """Fields of a message."""
    return {"index": index, "time_usec": round(time_s * 1e6), "rpm": rpm, "voltage": [16.0] * 4, "current": [5.0] * 4}


def decoded(decoder: Decoder, *messages: dict[str, Any]) -> list[Sample | None]:
    """What each of the messages gives."""
    return [decoder.decode("ESC_STATUS", json.dumps(fields), 104.0) for fields in messages]


def test_four_rotors_are_one_message() -> None:
    """In rad/s, at the vehicle's time on the host's clock."""
    (sample,) = decoded(Decoder(ClockMap()), batch(4.0, 0, [4800, 4810, 4790, 4805]))
    assert isinstance(sample, RotorSample)
    np.testing.assert_allclose(sample.speeds_rad_s, np.array((4800, 4810, 4790, 4805)) * RAD_S)
    assert sample.time_s == ClockMap().to_host(4.0, 104.0)


def test_the_messages_of_six_rotors_are_put_together() -> None:
    """The second one ends the sample; how many there are is known from the first time on."""
    first, second = [1, 2, 3, 4], [5, 6, 0, 0]
    got = decoded(Decoder(ClockMap()), *(batch(t, i, r) for t in (4.0, 4.02) for i, r in ((0, first), (4, second))))
    assert [None if s is None else len(s.speeds_rad_s) for s in got if s is None or isinstance(s, RotorSample)] == [
        4,
        8,
        None,
        8,
    ]
    assert isinstance(got[3], RotorSample)
    np.testing.assert_allclose(got[3].speeds_rad_s, np.array(first + second) * RAD_S)


def test_what_misses_its_beginning_is_left_out() -> None:
    """A lost first message, or a second one of another time: no sample of mixed times."""
    decoder = Decoder(ClockMap())
    decoded(decoder, batch(4.0, 0, [1, 2, 3, 4]), batch(4.0, 4, [5, 6, 0, 0]))
    assert decoded(decoder, batch(4.02, 4, [5, 6, 0, 0])) == [None]
    assert decoded(decoder, batch(4.04, 0, [1, 2, 3, 4]), batch(4.06, 4, [5, 6, 0, 0])) == [None, None]
    assert isinstance(decoded(decoder, batch(4.08, 0, [1, 2, 3, 4]), batch(4.08, 4, [5, 6, 0, 0]))[1], RotorSample)


@pytest.mark.parametrize(
    "fields", [batch(4.0, 0, [1, 2, 3]), batch(4.0, 3, [1] * 4), batch(4.0, 0, [None] * 4), {"index": 0}]
)
def test_malformed_messages_are_counted(fields: dict[str, Any]) -> None:
    """And end nothing."""
    decoder = Decoder(ClockMap())
    assert decoded(decoder, fields) == [None]
    assert decoder.dropped["ESC_STATUS"] == 1
