"""The results folder: one campaign at a time, and a journal that a kill at any moment leaves readable."""

from __future__ import annotations

import fcntl
import json
import os
import tempfile
import types
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from typing import IO, Any

from uasfly.campaign.fly import ERROR, Result
from uasfly.errors import FileError

JOURNAL = "journal.jsonl"
LOCK = "lock"


class ResultsFolder:
    """Results by flight id, kept in a journal: one line of JSON a flight, written as soon as it has landed.

    Only a whole line counts, so whoever is killed loses the flights that are in the air and nothing else.

    Attributes:
        path: the folder.
        results: what has been flown, by id; flights that ended in an error are not among them and are flown again.
    """

    def __init__(self, path: Path) -> None:
        """Name the folder; it is made and locked by `with`."""
        self.path = path
        self.results: dict[str, Result] = {}
        self._lock: IO[str] | None = None
        self._journal: FileIO | None = None

    def __enter__(self) -> ResultsFolder:
        """Make and lock the folder and read the journal.

        Raises:
            FileError: it cannot be used, or another campaign is using it.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = (self.path / LOCK).open("a+", encoding="utf-8")
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._lock.seek(0)
                who = self._lock.read(20).strip()
                self._lock.close()
                problem = f"another campaign is writing here{f' (process {who})' if who else ''}"
                raise FileError(str(self.path), [f"{problem}; wait for it, or choose another folder (--out)"]) from None
            self._lock.truncate(0)
            self._lock.write(f"{os.getpid()}\n")
            self._lock.flush()
            self._journal = (self.path / JOURNAL).open("ab", buffering=0)  # what does not fit shows at once
            self._read()
        except OSError as error:
            self.__exit__(None, None, None)
            raise _unusable(self.path, error) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        for stream in (self._journal, self._lock):
            if stream is not None:
                stream.close()
        self._journal = self._lock = None

    def keep(self, identity: str, result: Result) -> None:
        """Write a result down.

        Raises:
            FileError: when the disk is full, or gone.
        """
        assert self._journal is not None
        try:
            line = memoryview(json.dumps({"id": identity, **result}).encode() + b"\n")
            while line:
                line = line[self._journal.write(line) :]
            os.fsync(self._journal.fileno())
        except OSError as error:
            raise _unusable(self.path, error) from error
        self.results[identity] = result

    def write(self, name: str, write: Callable[[Path], Any]) -> Path:
        """Write a file in one step: whoever looks sees the old one or the new one.

        Args:
            name: of the file.
            write: gets the path to write to.

        Raises:
            FileError: when it cannot be written.
        """
        return write_whole(self.path / name, write)

    def _read(self) -> None:
        assert self._journal is not None
        with (self.path / JOURNAL).open("rb") as stream:
            self.results, whole = read_journal(stream)
        self._journal.truncate(whole)  # what was being written when the last campaign was killed


def journal_results(folder: Path) -> dict[str, Result]:
    """Results in a folder, which is neither made nor locked.

    Raises:
        FileError: the journal cannot be read.
    """
    path = folder / JOURNAL
    if not path.exists():
        return {}
    try:
        with path.open("rb") as stream:
            return read_journal(stream)[0]
    except OSError as error:
        raise FileError(str(path), [f"it cannot be read: {error.strerror or error}"]) from None


def read_journal(stream: IO[bytes]) -> tuple[dict[str, Result], int]:
    """Results by flight id, and how many bytes of the journal are whole lines."""
    results: dict[str, Result] = {}
    whole = 0
    for line in stream:
        if not line.endswith(b"\n"):
            break
        whole += len(line)
        try:
            row = json.loads(line)
            identity = row.pop("id")
            outcome = row["outcome"]
        except (ValueError, LookupError, TypeError, AttributeError):
            continue  # a line that a failing disk has spoilt: its flight is flown again
        if outcome == ERROR:
            results.pop(identity, None)
        else:
            results[identity] = row
    return results, whole


def write_whole(path: Path, write: Callable[[Path], Any]) -> Path:
    """Write a file beside its place and move it there in one step, see `ResultsFolder.write`."""
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as folder:
            draft = Path(folder) / path.name
            write(draft)
            draft.replace(path)
    except OSError as error:
        raise _unusable(path, error) from error
    return path


def _unusable(path: Path, error: OSError) -> FileError:
    reason = error.strerror or str(error)
    return FileError(str(path), [f"the results cannot be written: {reason}; make room, or choose another --out"])
