"""The simulated vehicle against PX4: every row of the table within its tolerance.

`python -m tests.conformance` prints the table, and so does `python -m pytest tests/conformance -s`; a run of all tests
ends with the number of its rows and those that are outside.
"""

from __future__ import annotations

import pytest

from tests.conformance.excitation import reference_rows
from tests.conformance.rows import Row, at_least, at_most, close, same, same_order
from tests.conformance.table import ROWS, recorded_rows, summary, table_text


def test_every_row_of_the_recording_is_within_its_tolerance(pytestconfig: pytest.Config) -> None:
    """Message set, rates, acknowledgements, modes, parameters, fields, failsafes and responses are PX4's."""
    _judge(recorded_rows(), pytestconfig)


def test_every_figure_that_was_measured_besides_is_within_its_tolerance(pytestconfig: pytest.Config) -> None:
    """A step of 15 degrees and hold in gusts, which need no recording."""
    _judge(reference_rows(), pytestconfig)


def test_rows_tell_what_is_outside() -> None:
    """A difference beyond the tolerance, NaN, and unlike values or orders are not within, and the table says so."""
    outside = [
        close("a", "number", (1.0, 1.2), 0.1),
        close("a", "not a number", (1.0, float("nan")), 0.1),
        same("a", "value", 1, 2),
        same_order("a", "order", [1, 2], [2, 1]),
        at_most("a", "largest", "", 2.0, 1.0, "m"),
        at_least("a", "smallest", "", 1.0, 2.0, "m"),
    ]
    assert not any(row.within for row in outside)
    assert summary(outside) == "conformance: 6 rows, 6 outside their tolerances"
    assert table_text(outside).count(" NO") == 6


def _judge(rows: list[Row], config: pytest.Config) -> None:
    """Keep the rows for the end of the run, then fail with those that are outside."""
    config.stash.setdefault(ROWS, []).extend(rows)
    outside = [row for row in rows if not row.within]
    assert not outside, "\n" + table_text(outside)
