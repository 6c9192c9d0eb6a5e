"""Coverage of a calibration on the terminal, and the live collection of views, with what to do next."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

if TYPE_CHECKING:
    from uasfly.messages import Array
    from uasfly.vision.calibration.board import BoardView, CharucoBoard
    from uasfly.vision.calibration.coverage import Coverage
    from uasfly.vision.frames import FrameSource, Image

_FULL, _SOME = 12, 3  # corners in a region


def coverage_text(covered: Coverage) -> Text:
    """The picture's regions as blocks, tilts and distances, what is missing."""
    text = Text()
    for row in covered.regions:
        for count in row:
            block, style = ("██", "green") if count >= _FULL else ("▒▒", "yellow") if count >= _SOME else ("··", "red")
            text.append(f" {block}", style=style)
        text.append("\n")
    left, right, up, down = covered.tilts_deg
    text.append(f"{covered.views} views; {100.0 * covered.covered:.0f} % of the picture covered; ")
    text.append(f"tilted {left:.0f}° / {right:.0f}° across, {up:.0f}° / {down:.0f}° up and down; ")
    text.append(f"nearest to farthest 1 : {covered.sizes:.1f}\n")
    for hint in covered.hints:
        text.append(f"→ {hint}\n", style="bold yellow")
    if covered.enough:
        text.append("enough\n", style="bold green")
    return text


def collect_live(
    source: FrameSource, board: CharucoBoard, most: int, console: Console, pause_s: float = 0.01
) -> tuple[list[BoardView], list[Array], dict[str, Image], tuple[int, int]]:
    """Views of the board from a camera until they are enough, the source ends, or Ctrl-C.

    Args:
        source: of frames.
        board: that is shown to it.
        most: views that are kept at most.
        console: where hints go.
        pause_s: how long to wait where there is no new frame.

    Returns:
        Views, their places and pictures, and the pictures' width and height (0, 0 where none came).
    """
    from uasfly.vision.calibration.coverage import coverage, is_new, place_of

    views: list[BoardView] = []
    places: list[Array] = []
    images: dict[str, Image] = {}
    size, said, covered = (0, 0), "", coverage([], [], 1, 1)
    seen = False
    with Live(console=console, auto_refresh=False, transient=True) as live:
        try:
            while not (covered.enough or len(views) >= most):
                for _, announcement in source.take_announcements():
                    console.print(Text(announcement, style="yellow"))
                frame = source.take()
                if frame is None:
                    if source.ended:
                        break
                    time.sleep(pause_s)
                    continue
                size = (frame.image.shape[1], frame.image.shape[0])
                view = board.find(f"frame {frame.sequence}", frame.image)
                if (view is not None) != seen or view is not None:
                    seen = view is not None
                    place = None if view is None else place_of(view, *size)
                    if view is not None and place is not None and is_new(place, places):
                        views.append(view)
                        places.append(place)
                        images[view.name] = frame.image
                        covered = coverage(views, places, *size)
                state = Text("the board is seen" if seen else "the board is not seen", style="green" if seen else "red")
                if console.is_terminal:
                    live.update(Group(coverage_text(covered), state), refresh=True)
                elif covered.hints[:1] != (said,) and covered.hints:
                    said = covered.hints[0]
                    console.print(Text(f"{len(views)} views: {said}"))
        except KeyboardInterrupt:
            console.print(Text("stopped; calibrating with what there is", style="yellow"))
    return views, places, images, size
