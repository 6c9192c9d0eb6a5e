"""Which tests need the computer for themselves, and signals as a shell in the foreground hands them on."""

from __future__ import annotations

import signal

import pytest

# They fly over a wire in real time: beside other work the computer, not uasfly, would be late. All others may share the
# cores (`-n 2`).
REAL_TIME = (
    "tests/bench/test_link_and_cycle.py",
    "tests/cli/test_preflight.py",
    "tests/drivers/test_faults.py",
    "tests/drivers/test_live.py",
    "tests/drivers/test_live_faults.py",
    "tests/drivers/test_metronome.py",
    "tests/drivers/test_preflight.py",
    "tests/drivers/test_sight.py::test_a_flight_over_mavlink",
    "tests/fuzz/test_fuzz.py::test_a_live_link",
    "tests/link/",
    "tests/sim_mavlink/",
    "tests/vision_sources/",
)


def pytest_configure() -> None:
    """Programs that tests start inherit what is ignored, as after `nohup` or in a script's background."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark those that need the computer."""
    for item in items:
        if item.nodeid.startswith(REAL_TIME):
            item.add_marker(pytest.mark.real_time)
