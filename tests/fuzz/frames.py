"""MAVLink as it may come over a wire: frames with a good checksum and odd contents, damaged ones, and plain rubbish."""

from __future__ import annotations

import math
import struct
from typing import Any

from pymavlink.dialects.v20 import development as dialect

from tests.fuzz.harness import Rng
from tests.fuzz.odd import choice

Fields = dict[str, Any]
CLASSES: dict[str, Any] = {message.msgname: message for message in dialect.mavlink_map.values()}
LARGEST_FLOAT: float = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
_BITS = {"b": 8, "h": 16, "i": 32, "q": 64}
_FLOATS = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    math.nan,
    math.inf,
    -math.inf,
    LARGEST_FLOAT,
    -LARGEST_FLOAT,
    1e-45,
    1e6,
    -1e9,
    21196.0,
)
_TEXTS = (
    b"truth",
    b"MIS_TAKEOFF_ALT",
    b"\xff\xfe\x80",
    b"",
    b"x" * 60,
    b"COM_OF_LOSS_T\0\0\0",
    b"\x00",
    b"%s%n",
    b"\x1b[2J",
)


def number(rng: Rng, letter: str) -> float | int:
    """A number of a struct letter, often at an edge."""
    if letter in "fd":
        kind = rng.integers(4)
        if kind == 0:
            return choice(rng, _FLOATS)
        if kind == 1:
            return float(struct.unpack("<f", rng.bytes(4))[0])
        return float(rng.normal(0.0, 10.0 ** rng.uniform(-2.0, 4.0)))
    bits = _BITS[letter.lower()]
    low, high = (0, (1 << bits) - 1) if letter.isupper() else (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    kind = rng.integers(4)
    if kind == 0:
        return choice(rng, (low, high, 0, 1, min(high, 127)))
    if kind == 1:
        return low + int.from_bytes(rng.bytes(8), "little") % (high - low + 1)
    return int(rng.integers(0, min(high, 300) + 1))


def odd_fields(rng: Rng, message: Any) -> Fields:
    """Fields of a message class, all within what the wire can carry."""
    letters = [letter for letter in message.unpacker.format.lstrip("<") if not letter.isdigit()]
    fields: Fields = {}
    for at, name in enumerate(message.ordered_fieldnames):
        length, letter = message.array_lengths[at], letters[at]
        if letter in "sc":
            fields[name] = choice(rng, _TEXTS) if rng.random() < 0.7 else rng.bytes(int(rng.integers(20)))
        elif length:
            fields[name] = [number(rng, letter) for _ in range(length)]
        else:
            fields[name] = number(rng, letter)
    if "target_system" in fields and rng.random() < 0.9:
        fields["target_system"] = choice(rng, (1, 1, 1, 0))
    if "target_component" in fields and rng.random() < 0.9:
        fields["target_component"] = choice(rng, (1, 1, 1, 0))
    return fields


def packed(rng: Rng, message: Any, source: tuple[int, int] | None = None) -> bytes:
    """A frame with a good checksum: MAVLink 2, or 1 where the message has a number below 256."""
    system, component = source or choice(rng, ((255, 190), (1, 191), (1, 1), (0, 0), (7, 1)))
    packer = dialect.MAVLink(None, system, component)
    packer.seq = int(rng.integers(256))
    return bytes(message.pack(packer, force_mavlink1=bool(message.get_msgId() < 256 and rng.random() < 0.2)))


def odd_frame(rng: Rng, source: tuple[int, int] | None = None, names: tuple[str, ...] = ()) -> bytes:
    """A good frame of any message, or one of `names`, with odd contents."""
    message = CLASSES[choice(rng, names or tuple(CLASSES))]
    fields = odd_fields(rng, message)
    return packed(rng, message(*(fields[name] for name in message.fieldnames)), source)


def damaged(rng: Rng, frame: bytes) -> bytes:
    """A frame that is no good any more, or still is."""
    content = bytearray(frame)
    kind = rng.integers(6)
    if kind == 0:
        return bytes(content[: int(rng.integers(len(content)))])
    if kind == 1:
        content[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
    elif kind == 2:
        content[0] = choice(rng, (0xFE, 0xFD, 0x00, 0x55))
    elif kind == 3:
        content[1] = int(rng.integers(256))
    elif kind == 4 and content[0] == 0xFD:
        content[2] = int(rng.integers(256))
    else:
        at = int(rng.integers(len(content) + 1))
        content[at:at] = rng.bytes(int(rng.integers(1, 9)))
    return bytes(content)


def rubbish(rng: Rng) -> bytes:
    """Bytes that are no frames."""
    kind = rng.integers(4)
    if kind == 0:
        return rng.bytes(int(rng.integers(0, 600)))
    if kind == 1:
        return choice(rng, (b"\xfd", b"\xfe", b"\xfd\xff\x00", b"\xfe\xff")) * int(rng.integers(1, 800))
    start = choice(rng, (b"\xfd", b"\xfe"))
    return b"".join(start + rng.bytes(int(rng.integers(30))) for _ in range(int(rng.integers(1, 30))))


def datagram(rng: Rng, source: tuple[int, int] | None = None, names: tuple[str, ...] = ()) -> bytes:
    """What one datagram may hold."""
    kind = rng.random()
    if kind < 0.12:
        return rubbish(rng)
    frames = [odd_frame(rng, source, names) for _ in range(1 if rng.random() < 0.85 else int(rng.integers(2, 8)))]
    if kind < 0.3:
        frames = [damaged(rng, frame) for frame in frames]
    if kind > 0.97:
        frames.insert(0, rng.bytes(int(rng.integers(1, 20))))
    return b"".join(frames)
