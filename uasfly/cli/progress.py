"""A progress bar for rehearsals on a terminal; nothing where there is none."""

from __future__ import annotations

import types

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from uasfly.messages import Status

CYCLES_PER_UPDATE = 50


class RehearsalProgress:
    """Shows phase and progress of a rehearsal on stderr."""

    def __init__(self, name: str) -> None:
        """Prepare the bar for a mission of this name."""
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
        self._progress = Progress(*columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal)
        self._name = escape(name)
        self._task = self._progress.add_task(self._name, total=1.0)
        self._cycles = 0

    def __enter__(self) -> RehearsalProgress:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._progress.stop()

    def update(self, status: Status) -> None:
        """Take in a step's status; the bar moves once a simulated second."""
        self._cycles += 1
        if self._cycles % CYCLES_PER_UPDATE == 0:
            text = f"{self._name}: {status.phase.value}"
            self._progress.update(self._task, completed=status.progress, description=text)


class BenchProgress:
    """Shows on stderr what the bench is measuring."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self._progress = Progress(*columns, console=console, disable=not console.is_terminal)
        self._task = self._progress.add_task("bench", total=1.0)

    def __enter__(self) -> BenchProgress:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._progress.stop()

    def update(self, text: str, done: float) -> None:
        """Tell what is measured now, and the share that has been."""
        self._progress.update(self._task, completed=done, description=text)


class PictureProgress:
    """Shows on stderr how many pictures have been looked at; how many there are is not known beforehand."""

    def __init__(self, name: str) -> None:
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed} pictures"))
        self._progress = Progress(*columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal)
        self._task = self._progress.add_task(escape(name), total=None)

    def __enter__(self) -> PictureProgress:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._progress.stop()

    def advance(self, text: str) -> None:
        """One more picture; what has been found so far."""
        self._progress.update(self._task, advance=1, description=escape(text))
