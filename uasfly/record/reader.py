"""Reads a flight log back, also one that ends in the middle because its writer was killed."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader

from uasfly import messages, preflight_messages
from uasfly.errors import FileError
from uasfly.record.encode import from_json

_TYPES = {
    kind.__name__: kind
    for module in (messages, preflight_messages)
    for kind in vars(module).values()
    if isinstance(kind, type) and hasattr(kind, "__dataclass_fields__")
}


@dataclass(frozen=True, slots=True)
class LoggedMessage:
    """One message of a log and the step time [s] under which it was written."""

    log_time_s: float
    message: Any


class LogReader:
    """A flight log as a stream of typed messages."""

    def __init__(self, path: Path) -> None:
        """Remember the file; nothing is read yet."""
        self.path = path
        self.complete = False
        """True once `messages` has met the end that a closed log has."""

    def description(self) -> dict[str, Any]:
        """What was flown: the metadata of the log's beginning.

        Raises:
            FileError: when the file is no flight log.
        """
        for record in self._records():
            if isinstance(record, Metadata) and record.name == "flight":
                return {key: json.loads(value) for key, value in record.metadata.items()}
        raise FileError(str(self.path), ["expected a flight log of uasfly, found no description of a flight in it"])

    def messages(self, kinds: tuple[type[Any], ...] = ()) -> Iterator[LoggedMessage]:
        """All messages, or those of some kinds, in the order in which they were written.

        Raises:
            FileError: when the file is no MCAP file; a log that breaks off merely ends early.
        """
        schemas: dict[int, str] = {}
        channels: dict[int, str] = {}
        for record in self._records():
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = schemas.get(record.schema_id, "")
            elif isinstance(record, Message):
                kind = _TYPES.get(channels.get(record.channel_id, ""))
                if kind is not None and (not kinds or kind in kinds):
                    yield LoggedMessage(record.log_time * 1e-9, from_json(kind, record.data))

    def _records(self) -> Iterator[Any]:
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise FileError(str(self.path), [f"the log cannot be read: {error.strerror or error}"]) from error
        with stream:
            if stream.read(5) != b"\x89MCAP":
                raise FileError(str(self.path), ["expected an MCAP flight log, found something else"])
            stream.seek(0)
            self.complete = False
            try:
                yield from StreamReader(stream).records
                self.complete = True
            except (McapError, EOFError, struct.error):  # it breaks off here
                return
