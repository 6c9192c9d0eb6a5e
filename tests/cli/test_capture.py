"""A picture of the live view: the right moment, valid XML, and nothing in it that is fetched from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.cli.scenes import not_finite, scene, status, unknown
from uasfly.cli.capture import Capture, picture
from uasfly.cli.scene import Note, Recent
from uasfly.cli.svg_shapes import with_shapes
from uasfly.drivers.watching import Cycle
from uasfly.errors import FileError
from uasfly.messages import Phase, Status

NAMESPACE = "http://www.w3.org/2000/svg"
CYCLE = Cycle(True, 2.0, 1.25)


def _words(svg: str) -> str:
    root = ElementTree.fromstring(svg)
    return " ".join(element.text or "" for element in root.iter(f"{{{NAMESPACE}}}text"))


def test_the_picture_is_valid_and_says_what_the_view_does() -> None:
    """Markup in a text stays text."""
    words = _words(picture(scene(notes=(Note(65.0, 4, "wind <b> & 'gust' takes 76 %"),))))
    for text in ("uasfly · hover · f550", "± 2.0 cm", "m/s² to E", "way home", "15.8 V", "spiral", "messages", "1:05"):
        assert text in words
    assert "wind <b> & 'gust' takes 76 %" in words


@pytest.mark.parametrize("of", [status(), unknown(), not_finite(float("nan"))])
def test_nothing_is_fetched_from_elsewhere(of: Status) -> None:
    """No host but the name of the format."""
    svg = picture(scene(of))
    assert re.findall(r"https?:[^\s\"')]*", svg) == [NAMESPACE]
    assert "url(" not in svg
    assert "@" not in svg
    ElementTree.fromstring(svg)


def test_blocks_and_frames_are_shapes() -> None:
    """They would stand apart with some fonts; a run of them is one rectangle."""
    text = '<text class="r1" x="12.2" y="20" textLength="61" clip-path="url(#a)">█▀▀&#160;─╮</text>'
    svg = with_shapes(text)
    assert "<text" not in svg
    assert '<rect class="r1" x="12.20" y="1.50" width="36.60" height="12.20"' in svg  # upper halves of all three
    assert '<rect class="r1" x="12.20" y="13.70" width="12.20" height="12.20"' in svg  # lower half of the first
    assert not set("█▀▄░─│╭╮╰╯") & set(picture(scene()))


def test_words_stand_where_the_terminal_has_them() -> None:
    """Each is placed by itself, so that no font shifts a column."""
    svg = with_shapes('<text class="r1" x="0" y="20" textLength="61">&#160;&#160;a&#160;&amp;b</text>')
    assert '<text class="r1" x="24.4" y="20.0" textLength="12.2">a</text>' in svg
    assert '<text class="r1" x="48.8" y="20.0" textLength="24.4">&amp;b</text>' in svg


def _flown(capture: Capture, phases: list[tuple[Phase, float]]) -> None:
    recent = Recent("uasfly")
    for k, (phase, progress) in enumerate(phases):
        recent.take(status(float(k), phase=phase, progress=progress), CYCLE)
        capture.look(recent)
    capture.write()


def test_it_shows_the_middle_of_the_legs(tmp_path: Path) -> None:
    """Not the landing."""
    path = tmp_path / "view.svg"
    legs = [(Phase.LEGS, 0.1 * k) for k in range(10)]
    _flown(Capture(path), [(Phase.TAKEOFF, 0.0), *legs, (Phase.ENDING, 1.0), (Phase.DONE, 1.0)])
    assert " 50 % " in _words(path.read_text(encoding="utf-8"))


def test_a_flight_that_ends_early_is_shown_in_its_last_moment_in_the_legs(tmp_path: Path) -> None:
    """Which tells what went wrong; one that has no legs is shown as it ended."""
    path = tmp_path / "view.svg"
    _flown(Capture(path), [(Phase.TAKEOFF, 0.0), (Phase.LEGS, 0.1), (Phase.LEGS, 0.2), (Phase.ABORTED, 0.0)])
    assert " 20 % " in _words(path.read_text(encoding="utf-8"))
    _flown(Capture(path), [(Phase.CONNECT, 0.0), (Phase.PREFLIGHT, 0.0)])
    assert "checking that the vehicle is ready" in _words(path.read_text(encoding="utf-8"))


def test_without_a_flight_nothing_is_written(tmp_path: Path) -> None:
    """No step, no picture."""
    Capture(tmp_path / "view.svg").write()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    """With its name and why."""
    with pytest.raises(FileError, match="picture cannot be written"):
        _flown(Capture(tmp_path / "missing" / "view.svg"), [(Phase.LEGS, 0.5)])
