"""Writes recommended settings into an airframe file: three numbers change, everything else stays as it stands there."""

from __future__ import annotations

from uasfly.airframe_file import Target, read_target, write_numbers
from uasfly.bench.recommend import Recommendation


def write_recommendation(target: Target, recommendation: Recommendation) -> list[str]:
    """Change the file in one step, and tell what has changed, a line each; nothing where nothing has.

    Raises:
        FileError: a field stands in the file in a way that cannot be changed in place, or the result is no airframe.
    """
    before = read_target(target)[1].controller
    fields = ("rate_hz", "horizon_s", "nodes")
    numbers = {field: (getattr(before, field), getattr(recommendation, field)) for field in fields}
    return write_numbers(target, "controller", numbers)
