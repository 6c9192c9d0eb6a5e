"""Small answers that keep clients content: time synchronisation, ping, and empty missions, files and logs."""

from __future__ import annotations

import struct
from collections.abc import Callable

from pymavlink.dialects.v20 import development as dialect

from uasfly.sim.mavlink.framing import Message
from uasfly.sim.mavlink.identity import Identity, Sender

# MAVLink FTP: opcodes and errors
_FTP_HEADER = struct.Struct("<HBBBBBBI")
_FTP_PAYLOAD = 251
_FTP_TERMINATE, _FTP_RESET, _FTP_LIST, _FTP_OPEN, _FTP_BURST, _FTP_CHECKSUM = 1, 2, 3, 4, 15, 14
_FTP_ACK, _FTP_NAK = 128, 129
_FTP_END_OF_FILE, _FTP_UNKNOWN_COMMAND, _FTP_NOT_FOUND = 6, 7, 10


class Services:
    """Answers what asks for nothing of the vehicle.

    Args:
        identity: ids of the vehicle.
        now_s: reads the vehicle's clock, which runs on between the steps of the simulation.
    """

    def __init__(self, identity: Identity, now_s: Callable[[], float]) -> None:
        self._identity = identity
        self._now_s = now_s

    def handlers(self) -> dict[str, Callable[[Message, Sender], list[Message]]]:
        """What to call for which message."""
        return {
            "TIMESYNC": self._timesync,
            "PING": self._ping,
            "MISSION_REQUEST_LIST": self._mission_list,
            "MISSION_COUNT": self._mission_upload,
            "MISSION_CLEAR_ALL": self._mission_clear,
            "FILE_TRANSFER_PROTOCOL": self._file_transfer,
            "LOG_REQUEST_LIST": self._log_list,
        }

    def _timesync(self, message: Message, _sender: Sender) -> list[Message]:
        """A request (tc1 = 0) goes back with the vehicle's time; answers to the vehicle's own requests need nothing.

        pymavlink does not know the message's target: clients recognise their requests by ts1, as they always have.
        """
        return [] if message.tc1 != 0 else [dialect.MAVLink_timesync_message(int(self._now_s() * 1e9), message.ts1)]

    def _ping(self, message: Message, sender: Sender) -> list[Message]:
        if message.target_system != 0 or message.target_component != 0:
            return []
        return [dialect.MAVLink_ping_message(message.time_usec, message.seq, sender.system, sender.component)]

    def _mission_list(self, message: Message, sender: Sender) -> list[Message]:
        return [dialect.MAVLink_mission_count_message(sender.system, sender.component, 0, message.mission_type)]

    def _mission_upload(self, message: Message, sender: Sender) -> list[Message]:
        verdict = dialect.MAV_MISSION_UNSUPPORTED if message.count else dialect.MAV_MISSION_ACCEPTED
        return [dialect.MAVLink_mission_ack_message(sender.system, sender.component, verdict, message.mission_type)]

    def _mission_clear(self, message: Message, sender: Sender) -> list[Message]:
        accepted = dialect.MAV_MISSION_ACCEPTED
        return [dialect.MAVLink_mission_ack_message(sender.system, sender.component, accepted, message.mission_type)]

    def _log_list(self, _message: Message, _sender: Sender) -> list[Message]:
        return [dialect.MAVLink_log_entry_message(0, 0, 0, 0, 0)]

    def _file_transfer(self, message: Message, sender: Sender) -> list[Message]:
        """There are no files: sessions end well, folders are empty, files are not found."""
        sequence, session, opcode, *_ = _FTP_HEADER.unpack(bytes(message.payload[: _FTP_HEADER.size]))
        if opcode in (_FTP_TERMINATE, _FTP_RESET):
            answer, content = _FTP_ACK, b""
        elif opcode in (_FTP_OPEN, _FTP_BURST, _FTP_CHECKSUM):
            answer, content = _FTP_NAK, bytes((_FTP_NOT_FOUND,))
        else:
            answer = _FTP_NAK
            content = bytes((_FTP_END_OF_FILE if opcode == _FTP_LIST else _FTP_UNKNOWN_COMMAND,))
        header = _FTP_HEADER.pack(sequence + 1 & 0xFFFF, session, answer, len(content), opcode, 0, 0, 0)
        payload = list((header + content).ljust(_FTP_PAYLOAD, b"\0"))
        return [dialect.MAVLink_file_transfer_protocol_message(0, sender.system, sender.component, payload)]
