"""The flight log: an MCAP file with one JSON channel a message type, complete up to the last second whatever happens.

Every half second of log time the chunk in progress is closed and handed to the operating system, so a killed process
loses at most that. A full disk stops the log, never the flight: `problem` then says why. A file that somebody has
removed is written on (whoever still holds it open has it) and `problem` says that it is gone.
"""

from __future__ import annotations

import json
import os
import queue
import threading
from pathlib import Path
from typing import IO, Any

from mcap.writer import CompressionType, IndexType, Writer

from uasfly import __version__
from uasfly.errors import FileError, describe_error
from uasfly.record.encode import json_schema, to_json

FLUSH_INTERVAL_S = 0.5
CLOSE_TIMEOUT_S = 10.0
PROFILE = "uasfly"


def topic_of(message_type: type[Any]) -> str:
    """Topic under which messages of a type are logged: `/odometry` for OdometrySample."""
    name = message_type.__name__.removesuffix("Sample")
    return "/" + "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")


class LogWriter:
    """Writes messages to an MCAP file in the calling thread; the same calls give the same bytes."""

    def __init__(self, path: Path, description: dict[str, object]) -> None:
        """Open the file and write what was flown.

        Args:
            path: the file; its folder must exist.
            description: plain data (airframe, mission, scenario, seed, ...), stored as MCAP metadata.

        Raises:
            FileError: when the file cannot be opened.
        """
        try:
            self._stream: IO[bytes] = path.open("wb")
        except OSError as error:
            reason = error.strerror or str(error)
            raise FileError(
                str(path), [f"the flight log cannot be written: {reason}; choose another file with --log"]
            ) from error
        self.path = path
        self.problem = ""
        self._stopped = False
        self._channels: dict[type[Any], int] = {}
        self._last_flush_s = -1e9
        self._writer: Any = Writer(
            self._stream,
            chunk_size=1 << 20,
            compression=CompressionType.ZSTD,
            index_types=IndexType.ALL,
        )
        self._writer.start(profile=PROFILE, library=f"uasfly {__version__}")
        self._writer.add_metadata("flight", {key: json.dumps(value) for key, value in description.items()})

    def write(self, message: Any, log_time_s: float) -> None:
        """Append one message; `log_time_s` is the step in which uasfly saw it (host time)."""
        if self._stopped:
            return
        try:
            channel = self._channels.get(type(message))
            if channel is None:
                channel = self._register(type(message))
            nanoseconds = round(log_time_s * 1e9)
            self._writer.add_message(channel, nanoseconds, to_json(message), nanoseconds)
            if log_time_s - self._last_flush_s >= FLUSH_INTERVAL_S:
                self._writer.flush()
                self._last_flush_s = log_time_s
                self._look_for_file()
        except OSError as error:
            self._give_up(error)

    def close(self) -> None:
        """Write the index and close; safe to call twice."""
        if self._stream.closed:
            return
        try:
            if not self._stopped:
                self._writer.finish()
        except OSError as error:
            self._give_up(error)
        finally:
            try:
                self._stream.close()
            except OSError as error:
                self._give_up(error)

    def _register(self, message_type: type[Any]) -> int:
        schema = json.dumps(json_schema(message_type)).encode()
        schema_id = self._writer.register_schema(message_type.__name__, "jsonschema", schema)
        channel: int = self._writer.register_channel(topic_of(message_type), "json", schema_id)
        self._channels[message_type] = channel
        return channel

    def _look_for_file(self) -> None:
        """A removed file takes everything without an error, and nobody ever finds it."""
        if self.problem:
            return
        try:
            there = os.path.samestat(self.path.stat(), os.fstat(self._stream.fileno()))
        except OSError:
            there = False
        if not there:
            self.problem = f"the flight log {self.path} is gone: the file or its folder was moved or removed"

    def _give_up(self, error: OSError) -> None:
        self._stopped = True
        self.problem = f"the flight log {self.path} stopped: {error.strerror or error}"


class BackgroundLogWriter:
    """The same log, written by a thread of its own, so that a slow card never delays a control cycle."""

    def __init__(self, path: Path, description: dict[str, object]) -> None:
        """Open the file (see `LogWriter`) and start the thread."""
        self._writer = LogWriter(path, description)
        self._problem = ""
        self._queue: queue.SimpleQueue[tuple[tuple[Any, ...], float] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="flight log", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        """The file that is written."""
        return self._writer.path

    @property
    def problem(self) -> str:
        """Why the log stopped, "" while it runs."""
        return self._problem or self._writer.problem

    def write(self, message: Any, log_time_s: float) -> None:
        """Hand one message over; returns at once."""
        self._queue.put(((message,), log_time_s))

    def write_all(self, messages: tuple[Any, ...], log_time_s: float) -> None:
        """Hand the messages of one step over, None standing for nothing; returns at once."""
        self._queue.put((messages, log_time_s))

    def close(self) -> None:
        """Write what is left and close the file, in ten seconds at most; safe to call twice."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join(CLOSE_TIMEOUT_S)
            if self._thread.is_alive():
                self._problem = f"the flight log {self.path} breaks off: its disk is too slow"

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._problem:
                continue
            messages, log_time_s = item
            try:
                for message in messages:
                    if message is not None:
                        self._writer.write(message, log_time_s)
            except Exception as error:
                self._problem = f"the flight log {self.path} stopped: {describe_error(error)}"
        self._writer.close()
