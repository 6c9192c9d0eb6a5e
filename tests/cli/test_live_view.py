"""The live view: plain lines without a terminal, a picture on one, and never in the way of the flight."""

from __future__ import annotations

import errno
import io
import math
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from uasfly.cli.live_view import LiveView
from uasfly.cli.output import finish, summary_table
from uasfly.errors import FileError
from uasfly.flight.summary import SummaryCollector
from uasfly.messages import Phase, StateEstimate, Status

ZERO = np.zeros(3)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


class Screen(io.StringIO):
    """A stream that can break as a closed terminal does."""

    broken = False

    def write(self, text: str) -> int:
        """Write, or fail with EIO."""
        if self.broken:
            raise OSError(errno.EIO, "Input/output error")
        return super().write(text)


def _console(screen: Screen, terminal: bool) -> Console:
    return Console(file=screen, force_terminal=terminal, width=100, color_system=None)


def _status(
    time_s: float,
    *,
    estimate: bool = True,
    force: tuple[float, float, float] = (1.5, 0.0, -0.2),
    fallback: str = "",
    announcements: tuple[tuple[int, str], ...] = (),
) -> Status:
    known = StateEstimate(
        time_s,
        np.array([1.0, -2.0, 1.5]),
        ZERO,
        LEVEL,
        ZERO,
        np.array(force),
        ZERO,
        np.full(3, 0.02),
        ZERO,
        ZERO,
    )
    reference = np.array([1.0, -2.0, 1.56]) if estimate else None
    phase = Phase.LEGS if estimate else Phase.CONNECT
    return Status(
        time_s, phase, 1, True, 0.25, known if estimate else None, reference, fallback, announcements=announcements
    )


def test_without_a_terminal_there_are_plain_lines_now_and_then() -> None:
    """A line every five seconds with phase, progress, position, error and force; nothing is redrawn."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=False)) as view:
        for k in range(601):
            view.update(_status(0.02 * k), 1.0)
    lines = screen.getvalue().splitlines()
    assert len(lines) == 3
    for word in ("legs", "25 %", "+1.00 -2.00 +1.50 m", "error 6.0 cm", "force +1.50 +0.00 -0.20 m/s²"):
        assert word in lines[0]
    assert "\x1b" not in screen.getvalue()


def test_without_a_terminal_every_announcement_is_a_line() -> None:
    """Also between the regular lines, with its time."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=False)) as view:
        view.update(_status(10.0))
        view.update(_status(10.5, announcements=((4, "gust [/red] over legs[0]"), (6, "phase ending"))))
    lines = screen.getvalue().splitlines()
    assert lines[1:] == ["[     10.50] gust [/red] over legs[0]", "[     10.50] phase ending"]


def _drawn(status: Status, solve_ms: float | None = 1.25, announcements: tuple[tuple[int, str], ...] = ()) -> str:
    """What a terminal shows of a step."""
    screen = Screen()
    console = _console(screen, terminal=True)
    view = LiveView("hover", "f550", console)
    view.update(_status(0.0, announcements=announcements))
    screen.seek(0)
    screen.truncate()
    console.print(view.render(status, solve_ms))
    return screen.getvalue()


def test_a_terminal_shows_phase_position_error_force_and_solver() -> None:
    """All of it in one picture, the last texts below."""
    text = _drawn(_status(1.0), announcements=((3, "telemetry is 0.6 s old"), (6, "phase legs")))
    assert "uasfly · hover · f550" in text
    assert "legs, leg 2" in text
    assert "east   +1.00  north   -2.00  up   +1.50 m" in text
    assert "± 2.0 cm" in text
    assert "6.0 cm" in text
    assert "→ 1.50 m/s²  up -0.20 m/s²" in text
    assert "1.25 ms" in text
    assert "fallback" not in text
    assert "telemetry is 0.6 s old" in text


@pytest.mark.parametrize(
    ("degrees", "arrow"), [(0, "→"), (45, "↗"), (90, "↑"), (135, "↖"), (180, "←"), (225, "↙"), (270, "↓"), (315, "↘")]
)
def test_the_arrow_points_where_the_wind_pushes_on_a_map(degrees: int, arrow: str) -> None:
    """East is right and north is up."""
    angle = math.radians(degrees)
    assert f"{arrow} 2.00 m/s²" in _drawn(_status(1.0, force=(2.0 * math.cos(angle), 2.0 * math.sin(angle), 0.0)))


def test_hardly_any_wind_has_no_direction() -> None:
    """A dot instead of an arrow that spins with the noise."""
    assert "· 0.01 m/s²" in _drawn(_status(1.0, force=(0.01, 0.0, 0.0)))


def test_a_fallback_is_named_beside_the_solver() -> None:
    """The pilot sees that the solver's answer was replaced, and by what."""
    assert "fallback: backup" in _drawn(_status(1.0, fallback="backup"))


@pytest.mark.parametrize("terminal", [False, True])
def test_nothing_is_needed_to_be_known(terminal: bool) -> None:
    """Before the first estimate, and without a solver: phase and progress alone."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal)) as view:
        view.say("connecting")
        view.update(_status(0.0, estimate=False), None)
    assert "connecting" in screen.getvalue()
    assert "connect" in screen.getvalue().replace("connecting", "")
    assert "position" not in screen.getvalue()


def test_a_terminal_is_redrawn_four_times_a_second() -> None:
    """Not with each of the fifty cycles."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        for k in range(100):
            view.update(_status(0.02 * k), 1.0)
    assert 7 <= screen.getvalue().count("legs, leg 2") <= 9


def test_names_are_shown_as_they_are() -> None:
    """A file name is no markup, whatever brackets it has."""
    screen = Screen()
    console = _console(screen, terminal=True)
    console.print(LiveView("my[/bold].yaml", "f550", console).render(_status(1.0), None))
    assert "my[/bold].yaml" in screen.getvalue()


def test_a_terminal_that_vanishes_does_not_take_the_result_along() -> None:
    """Leaving the view after the terminal was closed raises nothing."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        view.update(_status(0.0), 1.0)
        screen.broken = True
    screen.broken = False


def test_the_closing_table_shows_texts_as_they_are() -> None:
    """Reasons and warnings of the vehicle are no markup either."""
    summary = SummaryCollector()
    summary.warn("the vehicle says [/health] no")
    summary.abort(Status(1.0, Phase.ABORTED, -1, False, 0.0, None, None, reason="legs[0] refused [/x]"))
    names = {"mission": "hover", "airframe": "f550", "scenario": None}
    screen = Screen()
    _console(screen, terminal=False).print(summary_table(summary.result(wall_s=1.0, rejected={}, **names)))
    assert "[/health]" in screen.getvalue()
    assert "legs[0] refused [/x]" in screen.getvalue()
    assert "real vehicle" in screen.getvalue()


def test_a_summary_that_cannot_be_written_is_shown_nevertheless(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The flight's figures are not lost with the file."""
    summary = SummaryCollector().result(wall_s=1.0, rejected={}, mission="hover", airframe="f550", scenario="calm")
    with pytest.raises(FileError, match="cannot be written"):
        finish(summary, tmp_path / "missing" / "summary.json", as_json=True)
    assert '"mission": "hover"' in capsys.readouterr().out
