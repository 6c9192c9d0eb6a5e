"""The picture of one moment of a flight, for a pilot at arm's length: 80 columns and 24 rows, or what there is."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator

from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment

from uasfly.cli import readings
from uasfly.cli.big_text import ROWS, big
from uasfly.cli.blocks import Row, beside, box, fit, row, rule, spread
from uasfly.cli.gauges import bar, large_arrow, number, point_of_compass, small_arrow
from uasfly.cli.headline import PILOT, Headline, headline
from uasfly.cli.readings import LABEL, clock, severity_style
from uasfly.cli.scene import Scene
from uasfly.messages import Phase, Status

FULL_WIDTH, FULL_HEIGHT = 76, 22  # below, one line a value
WIDE = 120  # from here on messages have a column of their own
_MODE_GAP = 6


class Dashboard:
    """A scene as Rich draws it: as many rows as the terminal has."""

    def __init__(self, scene: Scene) -> None:
        """Take the moment to be drawn."""
        self._scene = scene

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Rich's protocol."""
        rows = draw(self._scene, options.max_width, options.height or options.size.height)
        for number_of, content in enumerate(rows):
            if number_of:
                yield Segment.line()
            yield from content


def draw(scene: Scene, width: int, height: int) -> list[Row]:
    """The rows of a picture."""
    top = headline(scene.status)
    if width < FULL_WIDTH or height < FULL_HEIGHT:
        return [fit(content, width) for content in _compact(scene, top, width, height)]
    if width < WIDE:
        rows = _full(scene, top, width)
        return [*rows, *_messages(scene, width, height - len(rows))]
    left = max(80, width * 3 // 5)
    rows = [*_full(scene, top, left - 2), *([[]] * height)][:height]
    return beside([fit(content, left) for content in rows], _messages(scene, width - left, height))


def _full(scene: Scene, top: Headline, width: int) -> list[Row]:
    status = scene.status
    third = (width - 32) // 2
    half = 41 + (width - 80) // 2
    health = (readings.battery(status, 8), readings.telemetry(status), readings.rates(scene), readings.solver(scene))
    return [
        *_banner(scene, top, width),
        *beside(
            box("error", _error(scene), third),
            _wind(scene, width - 2 * third),
            box("margin against wind", _margin(scene, third - 4), third),
        ),
        *beside(
            box("east · north · up", readings.where(status), half),
            box("health", health, width - half),
        ),
        _progress(scene, width),
    ]


def _banner(scene: Scene, top: Headline, width: int) -> list[Row]:
    """State and mode in large letters on the state's colour; the mode in small ones where there is no room."""
    status = scene.status
    style = _style(top)
    armed = "armed" if status.armed else "disarmed"
    pace = f"pace {number(status.pace * 100.0, '.0f')} %" if status.leg_started else ""
    mode = "" if status.phase is Phase.CONNECT else status.mode.value
    word, other = big(top.word), big(mode)
    if len(word[0]) + len(other[0]) + _MODE_GAP > width:
        other = ("", mode.upper(), "")
    pairs = ((scene.title, f"{armed}   {clock(scene.clock_s)}"), *zip(word, other, strict=True), (top.text, pace))
    return [[*row(("  ", style)), *_both_ends(*pair, style, width - 4), *row(("  ", style))] for pair in pairs]


def _both_ends(left: str, right: str, style: str, width: int) -> Row:
    gap = " " * (width - len(left) - len(right))
    return spread(row((left, style), (gap, style)), row((right, style)), width)


def _style(top: Headline) -> str:
    return f"bold {'white' if top.colour == PILOT else 'black'} on {top.colour}"


def _large(text: str, unit: str, colour: str) -> list[Row]:
    """A number in large digits with its unit beside."""
    rows = big(text)
    return [row((part, colour), (f"  {unit}" if unit and k == ROWS - 1 else "", "bold")) for k, part in enumerate(rows)]


def _error(scene: Scene) -> list[Row]:
    value = readings.error_m(scene.status)
    digits, unit = readings.distance(value)
    return [*_large(digits, unit, readings.error_colour(value)), *readings.sigmas(scene.status)]


def _wind(scene: Scene, width: int) -> list[Row]:
    """Where the wind pushes, how strong it is and where it comes from; until that is known, its force."""
    wind = scene.status.wind
    if wind is not None:
        title = "wind"
        east, north = readings.pushes(wind)
        lower = (
            row(("m/s ", "bold"), readings.wind_from(wind)),
            row(("gusts ", LABEL), f"{number(wind.gust_m_s, '.1f')} m/s"),
        )
        digits = _large(number(wind.mean_speed_m_s, ".1f"), "", "")
    else:
        title = "wind unknown, its force"
        east, north, up = readings.force(scene.status)
        size = math.hypot(east, north)
        lower = (
            row(("m/s² ", "bold"), point_of_compass(east, north)),
            row(("up ", LABEL), f"{number(up, '+.2f')} m/s²"),
        )
        digits = _large(number(size, ".2f" if size < 10.0 else ".1f"), "", "")
    texts = zip(large_arrow(east, north), [*digits, *lower], strict=True)
    return box(title, [[*row((arrow, "bold"), "  "), *text] for arrow, text in texts], width)


def _margin(scene: Scene, width: int) -> list[Row]:
    authority = scene.status.authority
    left, colour = readings.margin(authority)
    digits = _large(number(left * 100.0, ".0f"), "%", colour)
    if readings.cannot_hold(authority):
        gauge = row((" CANNOT HOLD ".center(width), "bold white on red"))
    else:
        filled, rest = bar(left, width)
        gauge = row((filled, colour), (rest, "dim"))
    return [*digits, gauge, readings.homeward(authority)]


def _progress(scene: Scene, width: int) -> Row:
    progress = scene.status.progress if not scene.status.reason else math.nan  # given up: none of it is left
    name = f" {readings.leg(scene)} "
    share = f" {number(progress * 100.0, '.0f', width=3)} % "
    room = max(8, width // 2)
    filled, rest = bar(progress, room)
    return spread(row((name, "bold")), row((filled, "cyan"), (rest, "dim"), share), width)


def _messages(scene: Scene, width: int, height: int) -> list[Row]:
    """What lasts, then what was said, newest first; long texts go on in the next row."""
    lines: list[Row] = [rule("messages", width)]
    for mark, text, style in _texts(scene):
        if len(lines) >= height:
            break
        parts = textwrap.wrap(text, max(10, width - len(mark) - 2)) or [""]
        lines += [row((mark if k == 0 else " " * len(mark), "dim"), (part, style)) for k, part in enumerate(parts)]
    lines += [[]] * (height - len(lines))
    return [fit(content, width) for content in lines[: max(0, height)]]


def _texts(scene: Scene) -> Iterator[tuple[str, str, str]]:
    """Mark, text and style of each message."""
    for alarm in scene.status.alarms:
        yield "   now  ", alarm.text, f"{severity_style(alarm.severity)} reverse"
    for note in scene.notes:
        text = note.text if note.times == 1 else f"{note.text} ({note.times} times)"
        yield f"{clock(note.clock_s):>6}  ", text, severity_style(note.severity)


def _wind_line(status: Status) -> Row:
    if status.wind is not None:
        arrow = small_arrow(*readings.pushes(status.wind))
        return row(readings.label("wind"), (f"{arrow} {readings.wind_in_words(status.wind)}", "bold"))
    east, north, up = readings.force(status)
    return row(
        readings.label("wind"),
        (f"{small_arrow(east, north)} {number(math.hypot(east, north), '.2f')} m/s²", "bold"),
        f"  up {number(up, '+.2f')}",
    )


def _compact(scene: Scene, top: Headline, width: int, height: int) -> Iterable[Row]:
    """One line a value, the most important first; three rows are kept for messages."""
    status = scene.status
    error = readings.error_m(status)
    digits, unit = readings.distance(error)
    left, colour = readings.margin(status.authority)
    filled, rest = bar(left, 10)
    hold = "cannot hold" if readings.cannot_hold(status.authority) else f"{number(left * 100.0, '.0f')} %"
    name = readings.label
    rows = [
        [*row((f" {top.word}  {status.mode.value} ".ljust(width), _style(top)))],
        row((top.text, "bold")),
        row(name("error"), (f"{digits} {unit}", f"bold {readings.error_colour(error)}")),
        _wind_line(status),
        row(name("margin"), (filled, colour), (rest, "dim"), (f" {hold}", colour)),
        readings.battery(status, 10),
        row(name("progress"), f"{number(status.progress * 100.0, '.0f')} %  {readings.leg(scene)}"),
        *readings.where(status)[:2],
        *readings.sigmas(status),
        readings.telemetry(status),
        readings.rates(scene),
        readings.solver(scene),
    ]
    messages = list(_texts(scene))
    rows = rows[: max(1, height - min(3, len(messages)))]
    said = [row((mark[-6:], "dim"), (text, style)) for mark, text, style in messages]
    return [*rows, *said][:height]
