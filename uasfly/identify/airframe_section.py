"""An identified drag as the section `wind` of an airframe file: as a line of text, and written into the file."""

from __future__ import annotations

from uasfly.airframe import Airframe
from uasfly.airframe_file import Target, read_target, write_numbers
from uasfly.errors import FileError
from uasfly.file_writing import write_checked
from uasfly.identify.drag import IdentifiedDrag
from uasfly.yaml_text import parse_yaml

SECTION = "wind"


def fields(found: IdentifiedDrag) -> dict[str, float]:
    """The section's numbers, rounded to what a flight tells."""
    return {
        "drag_1_s": round(found.drag_1_s, 4),
        "drag_1_m": round(found.drag_1_m, 5),
        "drag_sigma_share": round(found.share, 3),
    }


def section_line(found: IdentifiedDrag) -> str:
    """The section on a line."""
    return f"{SECTION}: {{ {', '.join(f'{field}: {value}' for field, value in fields(found).items())} }}"


def write_drag(target: Target, found: IdentifiedDrag) -> list[str]:
    """Put the section into the file, or its numbers where it is there already; tells what has changed, a line each.

    Everything else stays, so does `tilt_sigma_rad` of the section.

    Raises:
        FileError: the section stands in the file in a way that cannot be changed in place, or the file cannot be
            written.
    """
    text, airframe = read_target(target)
    if airframe.wind is not None:
        before, after = airframe.wind, fields(found)
        return write_numbers(
            target, SECTION, {field: (getattr(before, field), value) for field, value in after.items()}
        )
    document = parse_yaml(text, str(target.source))
    assert isinstance(document.data, dict)
    if SECTION in document.data:
        problem = f"line {document.line((SECTION,))}: {SECTION} is there without anything in it; take the line out"
        raise FileError(str(target.source), [problem])
    ending = "\r\n" if "\r\n" in text else "\n"
    gap = ending if text.endswith("\n") else 2 * ending
    write_checked(target.path, f"{text}{gap}{section_line(found)}{ending}", Airframe)
    return [section_line(found)]
