"""Progress bars on a terminal; nothing where there is none."""

from __future__ import annotations

import types
from typing import Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn

from uasfly.messages import Status

CYCLES_PER_UPDATE = 50


class _Bar:
    """One task on stderr: text, bar, what `columns` tell, and the time; shown while entered."""

    def __init__(self, text: str, *columns: ProgressColumn, total: float | None = 1.0) -> None:
        console = Console(stderr=True)
        shown = (TextColumn("{task.description}"), BarColumn(), *columns, TimeElapsedColumn())
        self._progress = Progress(*shown, console=console, disable=not console.is_terminal)
        self._task = self._progress.add_task(text, total=total)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._progress.stop()


class RehearsalProgress(_Bar):
    """Shows phase and progress of a rehearsal."""

    def __init__(self, name: str) -> None:
        """Prepare the bar for a mission of this name."""
        self._name = escape(name)
        super().__init__(self._name, TextColumn("{task.percentage:3.0f} %"))
        self._cycles = 0

    def update(self, status: Status) -> None:
        """Take in a step's status; the bar moves once a simulated second."""
        self._cycles += 1
        if self._cycles % CYCLES_PER_UPDATE == 0:
            text = f"{self._name}: {status.phase.value}"
            self._progress.update(self._task, completed=status.progress, description=text)


class BenchProgress(_Bar):
    """Shows what the bench is measuring."""

    def __init__(self) -> None:
        super().__init__("bench")

    def update(self, text: str, done: float) -> None:
        """Tell what is measured now, and the share that has been."""
        self._progress.update(self._task, completed=done, description=text)


class ReproduceProgress(_Bar):
    """Shows which of a paper's experiments is being flown."""

    def __init__(self, paper: str) -> None:
        """Prepare the bar for a paper of this name."""
        self._paper = escape(paper)
        super().__init__(self._paper, TextColumn("{task.percentage:3.0f} %"))

    def update(self, text: str, done: float) -> None:
        """Tell what is being flown now, and the share that has been."""
        self._progress.update(self._task, completed=done, description=f"{self._paper}: {escape(text)}")


class RecordingProgress(_Bar):
    """Shows how much of a recording is done, and what it holds."""

    def __init__(self) -> None:
        super().__init__("recording")

    def update(self, text: str, done: float) -> None:
        """Tell what there is so far, and the share of the time that is over."""
        self._progress.update(self._task, completed=done, description=escape(text))


class PictureProgress(_Bar):
    """Shows how many pictures have been looked at; how many there are is not known beforehand."""

    def __init__(self, name: str) -> None:
        super().__init__(escape(name), TextColumn("{task.completed} pictures"), total=None)

    def advance(self, text: str) -> None:
        """One more picture; what has been found so far."""
        self._progress.update(self._task, advance=1, description=escape(text))
