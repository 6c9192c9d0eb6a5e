"""Which tests need the computer for themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

# They fly over a wire in real time: beside other work the computer, not uasfly, would be late. All others may share the
# cores (`-n 2`).
REAL_TIME = (
    "bench/test_link_and_cycle.py",
    "cli/test_cli.py",
    "cli/test_preflight.py",
    "drivers/test_faults.py",
    "drivers/test_live.py",
    "drivers/test_live_faults.py",
    "drivers/test_metronome.py",
    "drivers/test_preflight.py",
    "drivers/test_sight.py",
    "fuzz/",
    "link/",
    "vision_sources/",
    "sim_mavlink/",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them."""
    here = Path(__file__).parent
    for item in items:
        if item.path.relative_to(here).as_posix().startswith(REAL_TIME):
            item.add_marker(pytest.mark.real_time)
