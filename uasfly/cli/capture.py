"""A picture of the live view as an SVG file: as it was half way through the legs."""

from __future__ import annotations

import io
import math
from pathlib import Path

from rich.console import Console
from rich.terminal_theme import TerminalTheme

from uasfly.cli.dashboard import Dashboard
from uasfly.cli.scene import Recent, Scene
from uasfly.cli.svg_shapes import with_shapes
from uasfly.errors import FileError
from uasfly.messages import Phase

COLUMNS, ROWS = 80, 24
LOOK_EVERY_S = 0.25
HALF_WAY = 0.5

# Rich's own template names a web font's host; whoever opens this file asks nobody for anything.
_TEMPLATE = """\
<svg class="rich-terminal" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg" role="img">
<title>uasfly's live view of a flight</title>
<style>
.{unique_id}-matrix {{
    font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, "Liberation Mono", monospace;
    font-size: {char_height}px; line-height: {line_height}px;
}}
.{unique_id}-title {{ font-size: 18px; font-weight: bold; font-family: sans-serif; }}
{styles}
</style>
{chrome}
<g transform="translate({terminal_x}, {terminal_y})">
{backgrounds}
<g class="{unique_id}-matrix">
{matrix}
</g>
</g>
</svg>
"""
_THEME = TerminalTheme(
    (16, 20, 27),
    (226, 230, 236),
    [
        (16, 20, 27),
        (239, 83, 80),
        (67, 190, 96),
        (240, 190, 60),
        (52, 108, 214),
        (190, 120, 220),
        (86, 196, 214),
        (226, 230, 236),
    ],
)


class Capture:
    """Keeps one moment of a flight: half way through the legs, or the last before where they do not come so far."""

    def __init__(self, path: Path) -> None:
        """Take the file to write."""
        self._path = path
        self._scene: Scene | None = None
        self._next_s = -math.inf

    def look(self, recent: Recent) -> None:
        """Take in the present moment; to be called in each step."""
        status = recent.status
        if status is None or status.time_s < self._next_s:
            return
        self._next_s = status.time_s + LOOK_EVERY_S
        in_legs = self._scene is not None and self._scene.status.phase is Phase.LEGS
        if not in_legs or (status.phase is Phase.LEGS and status.progress <= HALF_WAY):
            self._scene = recent.scene()

    def write(self) -> None:
        """Write the file; nothing where there was no flight at all.

        Raises:
            FileError: when it cannot be written.
        """
        if self._scene is None:
            return
        try:
            self._path.write_text(picture(self._scene), encoding="utf-8")
        except OSError as error:
            raise FileError(str(self._path), [f"the picture cannot be written: {error.strerror or error}"]) from error


def picture(scene: Scene) -> str:
    """The live view of a scene as SVG text."""
    console = Console(
        record=True, file=io.StringIO(), force_terminal=True, color_system="truecolor", width=COLUMNS, height=ROWS
    )
    console.print(Dashboard(scene))
    svg = console.export_svg(title="uasfly", theme=_THEME, code_format=_TEMPLATE, unique_id="view")
    return with_shapes(svg)
