"""Print the table: python -m tests.conformance."""

from __future__ import annotations

import sys

import pytest

from tests.conformance.table import all_rows, summary, table_text


def main() -> int:
    """Print every row; 0 where all are within their tolerances, 1 where not, 2 where there is no recording."""
    try:
        rows = all_rows()
    except pytest.skip.Exception as skipped:
        print(f"no table: {skipped}", file=sys.stderr)
        return 2
    print(table_text(rows))
    print(summary(rows))
    return 0 if all(row.within for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
