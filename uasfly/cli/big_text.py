"""Letters and digits three rows high, out of half blocks: what has to be read from a distance."""

from __future__ import annotations

from functools import lru_cache

ROWS = 3
_UNKNOWN = "### ..# .## ... .#."  # a question mark
_FONT = {
    "0": "### #.# #.# #.# ###",
    "1": ".#. ##. .#. .#. ###",
    "2": "### ..# ### #.. ###",
    "3": "### ..# .## ..# ###",
    "4": "#.# #.# ### ..# ..#",
    "5": "### #.. ### ..# ###",
    "6": "### #.. ### #.# ###",
    "7": "### ..# ..# ..# ..#",
    "8": "### #.# ### #.# ###",
    "9": "### #.# ### ..# ###",
    ".": ". . . . #",
    "-": ".. .. ## .. ..",
    "–": "... ... ### ... ...",
    "%": "#..# ..#. .##. .#.. #..#",
    " ": ".. .. .. .. ..",
    "A": "### #.# ### #.# #.#",
    "B": "##. #.# ##. #.# ###",
    "C": "### #.. #.. #.. ###",
    "D": "##. #.# #.# #.# ##.",
    "E": "### #.. ##. #.. ###",
    "F": "### #.. ##. #.. #..",
    "G": "#### #... #.## #..# ####",
    "H": "#.# #.# ### #.# #.#",
    "I": "# # # # #",
    "J": "..# ..# ..# #.# ###",
    "K": "#.# #.# ##. #.# #.#",
    "L": "#.. #.. #.. #.. ###",
    "M": "#...# ##.## #.#.# #...# #...#",
    "N": "#..# ##.# #.## #..# #..#",
    "O": "### #.# #.# #.# ###",
    "P": "### #.# ### #.. #..",
    "Q": "### #.# #.# ### ..#",
    "R": "##. #.# ##. #.# #.#",
    "S": "### #.. ### ..# ###",
    "T": "### .#. .#. .#. .#.",
    "U": "#.# #.# #.# #.# ###",
    "V": "#.# #.# #.# #.# .#.",
    "W": "#...# #...# #.#.# ##.## #...#",
    "X": "#.# #.# .#. #.# #.#",
    "Y": "#.# #.# ### .#. .#.",
    "Z": "### ..# .#. #.. ###",
}
HALVES = {(False, False): " ", (True, False): "▀", (False, True): "▄", (True, True): "█"}


@lru_cache(maxsize=256)
def big(text: str) -> tuple[str, str, str]:
    """The three rows of a text; capitals, digits and a few signs are known, anything else is a question mark."""
    glyphs = [_FONT.get(character, _UNKNOWN).split() for character in text.upper()]
    lines = [".".join(glyph[k] for glyph in glyphs) for k in range(5)]
    lines.append("." * len(lines[0]))
    top, middle, bottom = (
        "".join(HALVES[a == "#", b == "#"] for a, b in zip(lines[k], lines[k + 1], strict=True)) for k in (0, 2, 4)
    )
    return top, middle, bottom
