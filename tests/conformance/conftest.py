"""What a test run prints of the conformance table."""

from __future__ import annotations

import pytest

from tests.conformance.table import ROWS, summary, table_text


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """The whole table with -s; else one line, and the rows that are outside."""
    rows = config.stash.get(ROWS, [])
    if not rows:
        return
    shown = rows if config.getoption("capture") == "no" else [row for row in rows if not row.within]
    terminalreporter.section("conformance")
    if shown:
        terminalreporter.write_line(table_text(shown))
    terminalreporter.write_line(summary(rows))
