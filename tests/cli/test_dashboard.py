"""The picture: every value in it, nothing that is unknown breaks it, and it fits every terminal."""

from __future__ import annotations

import io
import math
import re
from collections import Counter
from typing import Any

import pytest
from rich.console import Console

from tests.cli.scenes import estimate, not_finite, scene, status, unknown
from tests.winds import wind_estimate
from uasfly.cli.big_text import big
from uasfly.cli.dashboard import Dashboard, draw
from uasfly.cli.gauges import bar, large_arrow, small_arrow
from uasfly.cli.headline import headline
from uasfly.cli.scene import Note, Scene
from uasfly.messages import Action, Alarm, Authority, FlightMode, Phase, Status

SIZES = [(80, 24), (40, 10), (76, 22), (79, 30), (100, 30), (140, 40), (240, 70), (20, 5), (1, 1)]
JUMP = Alarm("gnss_jump", Action.HOLD, 3, "GNSS jumps by 2.1 m")


def _text(of: Scene, width: int = 80, height: int = 24) -> str:
    console = Console(file=io.StringIO(), width=width, height=height, color_system=None)
    with console.capture() as capture:
        console.print(Dashboard(of))
    return capture.get()


def _style_of(of: Scene, text: str, width: int = 80) -> str:
    """Style of the first segment that is a text, or at least has it in it."""
    segments = [segment for row in draw(of, width, 24) for segment in row]
    found = [s for s in segments if s.text == text] or [s for s in segments if text in s.text]
    assert found, f"{text!r} is nowhere"
    return str(found[0].style)


def test_every_value_is_there() -> None:
    """At the smallest size of the full picture."""
    notes = (Note(65.0, 4, "wind takes 76 % of tilt and thrust"), Note(12.0, 6, "phase legs", times=3))
    text = _text(scene(status(alarms=(JUMP,)), notes))
    for words in (
        "uasfly · hover · f550 · gusty",
        "armed   1:15",
        "as planned, with a warning",
        "pace 100 %",
        "position ± 2.0 cm",
        "velocity ± 3.0 cm/s",
        "m/s² to E",
        "up -0.20 m/s²",
        "way home  takes 50 %",
        "position    +1.00   -2.00   +1.50 m",
        "reference   +1.00   -2.00   +1.56 m",
        "error        +0.0    +0.0    -6.0 cm",
        "velocity    +0.25   +0.00   -0.50 m/s",
        "battery   ███████░ 87 %  15.8 V",
        "telemetry 8 ms old",
        "control   50 Hz, setpoints 49 Hz",
        "solver    1.2 ms, median 1.0, 5 %",
        "leg 2 of 2 · spiral",
        "25 %",
        "now  GNSS jumps by 2.1 m",
        "1:05  wind takes 76 % of tilt and thrust",
        "0:12  phase legs (3 times)",
    ):
        assert words in text, words
    for large in ("FLYING", "OFFBOARD", "6.0", "1.50", "62"):
        for part in big(large):
            assert part in text, large
    assert "…" not in text


def windy(**changes: Any) -> Status:
    """The wind is known."""
    return status(wind=wind_estimate(**changes))


def test_the_wind_is_told_as_pilots_say_it() -> None:
    """Speed in large digits, where it comes from, gusts; the arrow points where it pushes; one line in a small view."""
    text = _text(scene(windy()))
    for words in ("─ wind ─", "m/s from 59°", "gusts 9.2 m/s", *big("5.8")):
        assert words in text, words
    assert "wind      ↙ 5.8 m/s from 59°, gusts 9.2" in _text(scene(windy()), 50, 12)


def test_a_wind_that_is_not_known_is_said_to_be_unknown() -> None:
    """Its force is told then; and a wind weaker than its sigma comes from nowhere."""
    assert "wind unknown, its force" in _text(scene(status()))
    calm = _text(scene(windy(mean_speed_m_s=0.1, mean_from_deg=math.nan)))
    assert "from" not in calm
    assert "wind      · 0.1 m/s, gusts 9.2" in _text(scene(windy(mean_speed_m_s=0.1, mean_from_deg=math.nan)), 50, 12)


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize(
    "of", [status(), windy(), unknown(), not_finite(math.nan), not_finite(math.inf), not_finite(-math.inf)]
)
def test_it_fits_every_terminal_whatever_is_known(of: Status, width: int, height: int) -> None:
    """No row is wider and there are no more of them than the terminal has."""
    long = Note(1.0, 3, "the vehicle left offboard for position: the pilot, or a failsafe of PX4, has it " * 3)
    lines = _text(scene(of, (long,) * 9), width, height).splitlines()
    assert len(lines) <= height
    assert all(len(line) <= width for line in lines)
    rows = draw(scene(of), width, height)
    assert all(sum(segment.cell_length for segment in row) <= width for row in rows)


def test_what_is_unknown_is_a_dash() -> None:
    """Before the first estimate; no number is made up and no "nan" shown."""
    text = _text(scene(unknown(), cycle_hz=math.nan, sent_hz=math.nan, solve_ms=math.nan, last_solve_ms=math.nan))
    assert "position ± – cm" in text
    assert "– %  – V" in text
    assert "none yet" in text
    assert "solver    – ms, median –, – %" in text
    assert not re.search(r"\bnan\b|\binf\b", text)
    assert not re.search(r"\bnan\b|\binf\b", _text(scene(not_finite(math.nan))))


def test_the_age_of_the_marker_is_told_where_a_mission_hangs_on_one() -> None:
    """Beside that of the telemetry; other missions have none."""
    assert "marker" not in _text(scene(status()))
    assert "marker 0.2 s" in _text(scene(status(marker_age_s=0.2)))


@pytest.mark.parametrize(
    ("changes", "word", "colour"),
    [
        ({}, "FLYING", "green"),
        ({"action": Action.WARN}, "FLYING", "green"),
        ({"action": Action.SLOW_DOWN}, "SLOWED", "yellow"),
        ({"action": Action.HOLD}, "HOLDING", "yellow"),
        ({"action": Action.BACK_OFF}, "BACKING OFF", "yellow"),
        ({"waits_for": "the marker"}, "WAITING", "yellow"),
        ({"waits_for": "the marker", "action": Action.LAND}, "LANDING", "red"),
        ({"action": Action.END}, "ENDING", "red"),
        ({"action": Action.RETURN}, "RETURNING", "red"),
        ({"action": Action.LAND}, "LANDING", "red"),
        ({"action": Action.HAND_OVER}, "HANDING OVER", "red"),
        ({"telemetry_age_s": 0.7}, "NO TELEMETRY", "red"),
        ({"phase": Phase.ENGAGE, "pilot_flies": True, "mode": FlightMode.POSITION}, "PILOT HAS IT", "blue"),
        ({"phase": Phase.ENGAGE}, "ENGAGING", "green"),
        ({"phase": Phase.CONNECT}, "CONNECTING", "white"),
        ({"phase": Phase.PREFLIGHT}, "PREFLIGHT", "white"),
        ({"phase": Phase.TAKEOFF}, "TAKE-OFF", "green"),
        ({"phase": Phase.ENDING, "mode": FlightMode.LAND}, "LANDING", "green"),
        ({"phase": Phase.ENDING, "mode": FlightMode.LAND, "reason": "battery is low"}, "LANDING", "red"),
        ({"phase": Phase.ENDING, "mode": FlightMode.RETURN}, "RETURNING", "green"),
        ({"phase": Phase.ENDING, "mode": FlightMode.OFFBOARD}, "ENDING", "green"),
        ({"phase": Phase.DONE}, "DONE", "green"),
        ({"phase": Phase.ABORTED, "reason": "stopped by Ctrl-C"}, "ABORTED", "red"),
    ],
)
def test_state_has_a_word_and_a_colour(changes: dict[str, Any], word: str, colour: str) -> None:
    """In the banner of the full picture and in the first line of the small one."""
    of = scene(status(**changes))
    assert (headline(of.status).word, headline(of.status).colour) == (word, colour)
    assert f"on {colour}" in _style_of(of, big(word)[0])
    assert f"on {colour}" in _style_of(of, word, width=40)


def test_outside_a_leg_the_progress_is_named_after_the_phase() -> None:
    """And an aborted mission has none left."""
    assert "between legs" in _text(scene(status(leg=-1)))
    assert " engage " in _text(scene(status(phase=Phase.ENGAGE, leg=-1)))
    aborted = _text(scene(status(phase=Phase.ABORTED, leg=-1, progress=1.0, reason="stopped by Ctrl-C")))
    assert "100 % " not in aborted.split("messages")[0].split("aborted ")[-1]


def test_an_action_says_why() -> None:
    """The text of the alarm that acts, not of a milder one."""
    mild = Alarm("wind", Action.WARN, 4, "wind takes 76 %")
    assert headline(status(action=Action.HOLD, alarms=(mild, JUMP))).text == JUMP.text
    assert headline(status(phase=Phase.ABORTED, reason="stopped by Ctrl-C")).text == "stopped by Ctrl-C"


@pytest.mark.parametrize(("up", "colour"), [(1.54, "green"), (1.4, "yellow"), (1.0, "red")])
def test_the_error_is_coloured(up: float, colour: str) -> None:
    """Green below 10 cm, yellow below 30 cm, red above."""
    of = scene(status(estimate=estimate(position=(1.0, -2.0, up))))
    digits = {1.54: "2.0", 1.4: "16.0", 1.0: "56.0"}[up]
    assert _style_of(of, big(digits)[0]) == colour


@pytest.mark.parametrize(
    ("peak", "digits", "colour"), [(0.38, "62", "green"), (0.8, "20", "yellow"), (0.96, "4", "red")]
)
def test_the_margin_is_what_the_wind_leaves(peak: float, digits: str, colour: str) -> None:
    """As number and bar in its colour."""
    of = scene(status(authority=Authority(0.3, 0.1, peak, 0.5)))
    assert _style_of(of, big(digits)[0]) == colour


@pytest.mark.parametrize("peak", [1.0, 1.7, math.inf])
def test_wind_that_takes_all_cannot_be_held(peak: float) -> None:
    """In words, in both sizes; nor can it be flown home in."""
    of = scene(status(authority=Authority(1.0, 0.1, peak, 1.2)))
    assert "CANNOT HOLD" in _text(of)
    assert "cannot return" in _text(of)
    assert "cannot hold" in _text(of, 40, 10)
    assert "CANNOT HOLD" not in _text(scene())


def test_battery_is_coloured_by_its_charge() -> None:
    """Green, yellow, red, and none where it is not known."""
    shares = (0.5, 0.25, 0.1)
    styles = [_style_of(scene(status(battery_remaining=share)), f" {share * 100:.0f} %") for share in shares]
    assert styles == ["green", "yellow", "red"]
    assert _style_of(scene(status(battery_remaining=math.nan, battery_voltage_v=math.nan)), " – %") == "dim"


def test_a_fallback_and_a_slow_loop_are_red() -> None:
    """The solver's answer was replaced; fewer cycles than planned."""
    of = scene(status(fallback="backup"), cycle_hz=40.0)
    assert "red" in _style_of(of, "fallback: backup")
    assert "red" in _style_of(of, "40")


def test_severities_have_their_colours_and_what_lasts_comes_first() -> None:
    """Errors red, warnings yellow."""
    notes = tuple(Note(10.0, severity, f"severity {severity}") for severity in (3, 4, 6))
    of = scene(status(alarms=(JUMP,)), notes)
    assert [_style_of(of, f"severity {k}") for k in (3, 4)] == ["bold red", "yellow"]
    assert "reverse" in _style_of(of, JUMP.text)
    text = _text(of)
    assert text.index(JUMP.text) < text.index("severity 3")


def test_a_small_terminal_keeps_what_matters_and_the_last_messages() -> None:
    """40 columns and 10 rows."""
    text = _text(scene(status(action=Action.HOLD, alarms=(JUMP,)), (Note(1.0, 4, "gust"),)), 40, 10)
    for words in ("HOLDING  offboard", "error     6.0 cm", "→ 1.50 m/s²", "62 %", "15.8 V", "GNSS jumps", "gust"):
        assert words in text


def test_a_wide_terminal_has_messages_beside() -> None:
    """In the first row."""
    lines = _text(scene(notes=(Note(1.0, 4, "gust"),)), 140, 30).splitlines()
    assert "messages" in lines[0]
    assert "gust" in lines[1]


def test_texts_cannot_move_the_cursor() -> None:
    """Control characters of a vehicle's text or a file's name are blanks."""
    text = _text(scene(notes=(Note(1.0, 4, "evil\x1b[2Jtext\r\x07"),), title="a\tb[/bold]"))
    assert not any(ord(c) < 32 and c != "\n" for c in text)
    assert "a b[/bold]" in text


@pytest.mark.parametrize(
    ("degrees", "arrow"), [(0, "→"), (45, "↗"), (90, "↑"), (135, "↖"), (180, "←"), (225, "↙"), (270, "↓"), (315, "↘")]
)
def test_the_arrow_points_where_the_wind_pushes_on_a_map(degrees: int, arrow: str) -> None:
    """East is right and north is up, in both sizes: the large one has its head, which is broader, on that side."""
    east, north = 2.0 * math.cos(math.radians(degrees)), 2.0 * math.sin(math.radians(degrees))
    assert small_arrow(east, north) == arrow
    weight = Counter({"█": 2, "▀": 1, "▄": 1})
    filled = [
        (x - 4.5, 4.0 - 2 * y, weight[c]) for y, r in enumerate(large_arrow(east, north)) for x, c in enumerate(r)
    ]
    ahead = sum(w for x, y, w in filled if x * east + y * north > 0)
    behind = sum(w for x, y, w in filled if x * east + y * north < 0)
    assert ahead > 1.3 * behind


@pytest.mark.parametrize("force", [(0.01, 0.0), (math.nan, 1.0), (math.inf, 0.0)])
def test_hardly_any_wind_has_no_direction(force: tuple[float, float]) -> None:
    """A dot instead of an arrow that spins with the noise."""
    assert small_arrow(*force) == "·"
    assert sum(map(len, "".join(large_arrow(*force)).split())) <= 4


def test_a_bar_is_as_long_as_its_share() -> None:
    """Never longer than its width, and empty where nothing is known."""
    assert bar(0.5, 10) == ("█████", "░░░░░")
    assert bar(7.0, 10) == ("█" * 10, "")
    assert bar(-1.0, 10) == bar(math.nan, 10) == ("", "░" * 10)


def test_large_letters_are_even() -> None:
    """Three rows of the same width, also for what the font does not have."""
    for text in ("HANDING OVER", "-12.34", "é?", ""):
        assert len({len(part) for part in big(text)}) == 1
