"""MAVLink frames out of datagrams that may hold anything.

pymavlink's own stream parser keeps an unfinished frame for the next datagram and takes a damaged length at its word,
so that one bad datagram swallows good ones. Here every datagram is read for itself and a bad frame costs one byte.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import development as dialect

Message = Any  # pymavlink's classes carry no types

_MARKER_V1, _MARKER_V2 = 0xFE, 0xFD
_OVERHEAD_V1, _OVERHEAD_V2, _SIGNATURE = 8, 12, 13
_SIGNED = 0x01
MAX_BAD_FRAMES = 16  # a datagram of nothing but start bytes must not cost a checksum a byte


class UnlistedMessage(dialect.MAVLink_message):  # type: ignore[misc]
    """A message that PX4 sends and pymavlink leaves out of its dialects."""

    def __init__(self, message_id: int, name: str, crc_extra: int, payload: bytes) -> None:
        super().__init__(message_id, name)
        self._extra = crc_extra
        self._content = payload

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """The frame, as pymavlink packs its own messages."""
        packed: bytes = self._pack(mav, self._extra, self._content, force_mavlink1=force_mavlink1)
        return packed


class FrameReader:
    """Takes messages out of datagrams.

    Attributes:
        good, bad: frames accepted and refused so far (unknown messages count as neither).
    """

    def __init__(self) -> None:
        self._decoder = dialect.MAVLink(None)
        self.good = 0
        self.bad = 0

    def messages(self, datagram: bytes) -> Iterator[Message]:
        """Yield the messages of one datagram, in order; everything that is no frame is skipped."""
        bad_before = self.bad
        start = 0
        while (start := _next_marker(datagram, start)) >= 0:
            frame = _frame_at(datagram, start)
            message = self._decode(frame) if frame else None
            if message is None:
                self.bad += 1
                start += 1
                if self.bad - bad_before >= MAX_BAD_FRAMES:
                    return
                continue
            start += len(frame)
            if message.get_msgId() >= 0:  # pymavlink gives unknown messages a negative one, and cannot check them
                self.good += 1
                yield message

    def _decode(self, frame: bytes) -> Message | None:
        try:
            return self._decoder.decode(bytearray(frame))
        except dialect.MAVError:
            return None


def _next_marker(datagram: bytes, start: int) -> int:
    found = [at for at in (datagram.find(_MARKER_V1, start), datagram.find(_MARKER_V2, start)) if at >= 0]
    return min(found, default=-1)


def _frame_at(datagram: bytes, start: int) -> bytes:
    """The frame that begins at `start`, b"" when it cannot be one or is cut off."""
    if len(datagram) - start < _OVERHEAD_V1:
        return b""
    length = datagram[start + 1]
    if datagram[start] == _MARKER_V1:
        size = length + _OVERHEAD_V1
    else:
        incompatible = datagram[start + 2]
        if incompatible & ~_SIGNED:
            return b""
        size = length + _OVERHEAD_V2 + (_SIGNATURE if incompatible & _SIGNED else 0)
    return datagram[start : start + size] if start + size <= len(datagram) else b""
