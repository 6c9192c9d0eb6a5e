import random
import struct

from pymavlink.dialects.v20 import development as dialect
from pymavlink.dialects.v20.common import MAVLink_ping_message as Ping

from uasfly.sim.mavlink.framing import MAX_BAD_FRAMES, FrameReader


def _frame(number: int, signed: bool = False) -> bytes:
    sender = dialect.MAVLink(None, 1, 191)
    if signed:
        sender.signing.secret_key = bytes(32)
        sender.signing.sign_outgoing = True
    return bytes(dialect.MAVLink_ping_message(number + 1, number, 0, 0).pack(sender))


def _numbers(datagram: bytes) -> list[int]:
    return [message.seq for message in FrameReader().messages(datagram)]


def test_several_frames_of_a_datagram_come_in_order() -> None:
    """A datagram may hold more than one frame, of both protocol versions, signed or not."""
    old = bytes(Ping(5, 3, 0, 0).pack(dialect.MAVLink(None, 1, 191), force_mavlink1=True))
    assert _numbers(_frame(0) + _frame(1) + old + _frame(4, signed=True)) == [0, 1, 3, 4]


def test_garbage_around_frames_costs_no_frame() -> None:
    """Bytes before, between and after frames are skipped, start bytes among them included."""
    assert _numbers(b"\xfd\xff\x00abc" + _frame(1) + b"\xfe\x01" + _frame(2) + b"\xfd\xff") == [1, 2]


def test_a_damaged_frame_does_not_take_the_next_with_it() -> None:
    """A wrong length or checksum costs that frame only."""
    long = bytearray(_frame(1))
    long[1] = 200
    broken = bytearray(_frame(2))
    broken[-1] ^= 0xFF
    assert _numbers(bytes(long) + bytes(broken) + _frame(3)) == [3]


def test_a_truncated_frame_is_not_continued_by_the_next_datagram() -> None:
    """Every datagram is read for itself."""
    reader = FrameReader()
    assert list(reader.messages(_frame(1)[:-3])) == []
    assert [message.seq for message in reader.messages(_frame(2))] == [2]
    assert (reader.good, reader.bad) == (1, 1)


def test_unknown_messages_and_flags_are_skipped() -> None:
    """A message that pymavlink does not know is passed over; a frame with unknown incompatibility flags is none."""
    unknown = struct.pack("<BBBBBBBHB", 0xFD, 4, 0, 0, 0, 1, 1, 50123, 0) + bytes(4) + b"\x12\x34"
    strange = bytearray(_frame(1))
    strange[2] = 0x02
    assert _numbers(unknown + _frame(2)) == [2]
    assert _numbers(bytes(strange)) == []


def test_random_bytes_never_raise() -> None:
    """Whatever comes in, the reader answers with messages or nothing."""
    random_bytes = random.Random(1)
    reader = FrameReader()
    for _ in range(2000):
        size = random_bytes.randint(0, 300)
        datagram = bytearray(random_bytes.randbytes(size))
        if datagram and random_bytes.random() < 0.7:
            datagram[0] = random_bytes.choice((0xFD, 0xFE))
        if size > 3 and random_bytes.random() < 0.5:
            datagram[1], datagram[2] = random_bytes.randint(0, 40), 0
        assert list(reader.messages(bytes(datagram))) == []


def test_a_datagram_of_start_bytes_is_given_up() -> None:
    """The largest datagram of nothing but start bytes costs a few checksums, not 65000."""
    reader = FrameReader()
    assert list(reader.messages(b"\xfd" * 65000)) == []
    assert reader.bad == MAX_BAD_FRAMES
