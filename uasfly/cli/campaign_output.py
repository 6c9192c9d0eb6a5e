"""How a campaign is shown: a bar while it flies, tables at the end."""

from __future__ import annotations

import types
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from uasfly.campaign.report import GROUP_HEADINGS, flight_text, group_cells

LINES = 10  # without a terminal: a line a tenth of the flights
ESTIMATE_OVER_S = 300.0


class CampaignProgress:
    """Shows on stderr how many flights have landed, how many were successful, and how long it will take.

    Attributes:
        count: flights that are there.
    """

    def __init__(self, name: str) -> None:
        """Prepare the bar of a campaign of this name."""
        self._console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
            refresh_per_second=2,
            speed_estimate_period=ESTIMATE_OVER_S,
        )
        self._name = escape(name)
        self._total = 0
        self._successes = 0
        self.count = 0

    def __enter__(self) -> CampaignProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._progress.stop()

    def begin(self, kept: int, total: int, successes: int) -> None:
        """See `uasfly.campaign.run.Progress`."""
        self.count, self._total, self._successes = kept, total, successes
        if kept:
            self._console.print(f"{kept} of {total} flights are there already", highlight=False)
        self._task = self._progress.add_task(self._description(), total=total, completed=kept)
        self._progress.start()

    def landed(self, success: bool) -> None:
        """See `uasfly.campaign.run.Progress`."""
        self.count += 1
        self._successes += success
        self._progress.update(self._task, advance=1, description=self._description())
        if (
            not self._console.is_terminal
            and self.count * LINES // self._total > (self.count - 1) * LINES // self._total
        ):
            self._console.print(f"{self.count}/{self._total} flights, {self._successes} successful", highlight=False)

    def _description(self) -> str:
        return f"{self._name}: {self._successes} of {self.count} successful" if self.count else self._name


def print_summary(summary: dict[str, Any]) -> None:
    """Groups, the worst flights with their commands, and where everything is."""
    console = Console()
    table = Table(title=escape(f"{summary['campaign']}: {summary['successes']} of {summary['flown']} successful"))
    for heading in GROUP_HEADINGS:
        table.add_column(heading, overflow="fold", justify="left" if heading == "group" else "right")
    among = [group["what"] for group in summary["groups"]]
    for group in summary["groups"]:
        style = "" if group["successes"] == group["flights"] else "yellow"
        table.add_row(*(escape(cell) for cell in group_cells(group, among)), style=style)
    console.print(table)
    console.print("Intervals: 95 %. The worst flights, and how to repeat them:", highlight=False)
    for flight in summary["worst"][:3]:
        console.print(f"  {flight_text(flight)}", highlight=False, markup=False)
        console.print(f"    {flight['command']}", highlight=False, markup=False, soft_wrap=True)
    for note in summary["notes"]:
        console.print(f"note: {note}", highlight=False, markup=False)
    names = ", ".join(path.rpartition("/")[2] for path in summary["files"])
    console.print(f"{summary['folder']}: {names}", highlight=False, markup=False, soft_wrap=True)
