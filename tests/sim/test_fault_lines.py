"""Lines of text become faults, or one complaint each."""

from __future__ import annotations

import pytest

from uasfly.errors import FileError
from uasfly.sim.fault_lines import LONGEST_LINE, FaultLines, parse_fault
from uasfly.sim.faults import Fault, GnssLost, Wind


def test_a_line_of_yaml_or_json_is_a_fault() -> None:
    """As a scenario file has it."""
    assert parse_fault("{kind: gnss_lost, duration_s: 20}") == GnssLost(kind="gnss_lost", duration_s=20.0)
    wind = parse_fault('{"kind": "wind", "velocity_m_s": [3, 0, 0]}')
    assert wind == Wind(kind="wind", velocity_m_s=(3.0, 0.0, 0.0))
    assert parse_fault(wind.model_dump_json()) == wind


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("{kind: gnss_lots}", "fault.kind: expected one of gnss_lost"),
        ("{kind: gnss_lost, duration_s: long}", "fault.duration_s: expected a number"),
        ("{kind: gnss_lost, duration: 1}", "fault.duration is not a known field; did you mean duration_s?"),
        ("{kind: wind, velocity_m_s: [1e300, 0, 0]}", "not above 100"),
        ("{kind: motor, motor: '1', effectiveness: 0.5}", "fault.motor: expected a whole number"),
        ("{kind: [" + "x, " * 900 + "]}", "fault.kind"),
        ("7", "fault: expected a block of fields, found 7"),
        ("{kind: ", "not valid YAML"),
    ],
)
def test_a_line_that_is_none_says_what_was_expected(line: str, said: str) -> None:
    """As the error of a file does, however long the line is."""
    with pytest.raises(FileError) as caught:
        parse_fault(line)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_bytes_may_come_in_any_pieces() -> None:
    """A line that never ends is given up; what comes after it is taken."""
    faults: list[Fault] = []
    complaints: list[str] = []
    lines = FaultLines(faults.append, complaints.append)
    for piece in (
        b"{kind: gn",
        b"ss_lost}\n\n\xff\n{kind: reb",
        b"oot}\n",
        b"x" * (LONGEST_LINE + 1),
        b"\n{kind: reboot}\n",
    ):
        lines.feed(piece)
    assert [fault.kind for fault in faults] == ["gnss_lost", "reboot", "reboot"]
    assert len(complaints) == 2
