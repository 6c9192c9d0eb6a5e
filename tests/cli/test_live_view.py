"""The live view: plain lines without a terminal, a picture on one, and never in the way of the flight."""

from __future__ import annotations

import errno
import io
from pathlib import Path

import pytest
from rich.console import Console

from tests.cli.scenes import status, unknown
from uasfly.cli.live_view import LiveView
from uasfly.cli.output import finish, summary_table
from uasfly.drivers.watching import Cycle
from uasfly.errors import FileError
from uasfly.flight.summary import SummaryCollector
from uasfly.messages import Phase, Status

CYCLE = Cycle(True, 2.0, 1.25)
ENTER, LEAVE = "\x1b[?1049h", "\x1b[?1049l"
HIDE_CURSOR, SHOW_CURSOR = "\x1b[?25l", "\x1b[?25h"


class Screen(io.StringIO):
    """A stream that can break as a closed terminal does."""

    broken = False

    def write(self, text: str) -> int:
        """Write, or fail with EIO."""
        if self.broken:
            raise OSError(errno.EIO, "Input/output error")
        return super().write(text)


class Clock:
    """Tells the time that the test wants."""

    now_s = 0.0

    def __call__(self) -> float:
        """Now."""
        return self.now_s


def _console(screen: Screen, terminal: bool) -> Console:
    return Console(file=screen, force_terminal=terminal, width=100, color_system=None)


def test_without_a_terminal_there_are_plain_lines_now_and_then() -> None:
    """A line every five seconds with phase, progress, position, error, force and wind; nothing is redrawn."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=False)) as view:
        for k in range(601):
            view.update(status(0.02 * k), CYCLE)
    lines = screen.getvalue().splitlines()
    assert len(lines) == 3
    for word in ("legs", "25 %", "+1.00 -2.00 +1.50 m", "error 6.0 cm", "force +1.50 +0.00 -0.20 m/s²", "wind unknown"):
        assert word in lines[0]
    assert "\x1b" not in screen.getvalue()


def test_without_a_terminal_every_announcement_is_a_line() -> None:
    """Also between the regular lines, with its time."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=False)) as view:
        view.update(status(10.0), CYCLE)
        view.update(status(10.5, announcements=((4, "gust [/red] over legs[0]"), (6, "phase ending"))), CYCLE)
    lines = screen.getvalue().splitlines()
    assert lines[1:] == ["[     10.50] gust [/red] over legs[0]", "[     10.50] phase ending"]


def test_a_terminal_shows_the_picture_on_its_other_screen() -> None:
    """What was on it before is there again afterwards, with the cursor."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        view.say("connecting")
        assert ENTER not in screen.getvalue()
        view.update(status(), CYCLE)
    text = screen.getvalue()
    assert text.index("connecting") < text.index(ENTER) < text.index("uasfly · hover · f550") < text.index(LEAVE)
    assert text.index(LEAVE) > text.rindex("uasfly · hover · f550")
    assert text.rindex(SHOW_CURSOR) > text.rindex(HIDE_CURSOR)


def test_leaving_without_a_step_leaves_the_terminal_alone() -> None:
    """No vehicle: an error message follows, on the screen where the command was typed."""
    screen = Screen()
    with pytest.raises(ZeroDivisionError), LiveView("hover", "f550", _console(screen, terminal=True)):
        raise ZeroDivisionError
    assert screen.getvalue() == ""


def test_an_error_in_flight_restores_the_terminal_too() -> None:
    """The message is then read on the usual screen."""
    screen = Screen()
    with pytest.raises(ZeroDivisionError), LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        view.update(status(), CYCLE)
        raise ZeroDivisionError
    assert screen.getvalue().rindex(LEAVE) > screen.getvalue().rindex(ENTER)


def test_a_late_step_does_not_open_the_screen_again() -> None:
    """The thread that shows the steps may still have one when the flight is over."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        pass
    view.update(status(), CYCLE)
    assert screen.getvalue() == ""


@pytest.mark.parametrize("terminal", [False, True])
def test_nothing_is_needed_to_be_known(terminal: bool) -> None:
    """Before the first estimate, and without a solver."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal)) as view:
        view.say("connecting")
        view.update(unknown(), Cycle(False, 0.0, None))
    assert "connecting" in screen.getvalue()
    assert ("connect  0 %" in screen.getvalue()) is not terminal


def test_a_terminal_is_redrawn_four_times_a_second() -> None:
    """Not with each of the fifty cycles, and each drawing begins in the corner instead of clearing the screen."""
    screen, clock = Screen(), Clock()
    with LiveView("hover", "f550", _console(screen, terminal=True), clock=clock) as view:
        for k in range(100):
            clock.now_s = 0.02 * k
            view.update(status(0.02 * k), CYCLE)
        assert 7 <= screen.getvalue().count("uasfly · hover") <= 9
        assert screen.getvalue().count("\x1b[2J") <= 1  # Rich, as it opens the other screen


def test_a_slow_terminal_sees_no_old_steps() -> None:
    """Drawing takes a second: the steps that have waited meanwhile are passed over, and the last of them is drawn."""
    screen, clock = Screen(), Clock()
    with LiveView("hover", "f550", _console(screen, terminal=True), clock=clock) as view:
        view.update(status(0.0), CYCLE)
        clock.now_s = 1.0
        for k in range(1, 51):
            view.update(status(0.02 * k), CYCLE)
    assert screen.getvalue().count("uasfly · hover") == 2


def test_a_terminal_that_cannot_move_its_cursor_gets_plain_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """TERM=dumb."""
    monkeypatch.setenv("TERM", "dumb")
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        view.update(status(), CYCLE)
    assert "legs  25 %" in screen.getvalue()
    assert "\x1b" not in screen.getvalue()


def test_a_terminal_that_vanishes_does_not_take_the_result_along() -> None:
    """Leaving the view after the terminal was closed raises nothing."""
    screen = Screen()
    with LiveView("hover", "f550", _console(screen, terminal=True)) as view:
        view.update(status(0.0), CYCLE)
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
