"""Writes what a calibration has found into a camera file: some fields change, everything else stays as it stands there.

Comments that a calibration writes begin with its name ("# lens: ..."), so that the next one takes their place.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from uasfly.camera import Camera
from uasfly.file_writing import write_checked
from uasfly.files import load_file

FRESH = """\
name: camera
width_px: 640
height_px: 480
fx: 600.0
fy: 600.0
cx: 319.5
cy: 239.5
distortion: []
# A guess: at the body's origin, looking ahead. Measure it.
transform_camera_to_body:
  position_m: [0.0, 0.0, 0.0]
  rpy_deg: [-90.0, 0.0, -90.0]  # ahead; straight down with the picture's top to the nose is [180, 0, -90]
mounting_sigma_m: 0.05
mounting_sigma_deg: 5.0
"""


def camera_text(path: Path | None) -> str:
    """Text of a camera file that is right, or of a fresh one.

    Raises:
        FileError: it cannot be read, or is no camera file.
    """
    if path is None:
        return FRESH
    load_file(path, Camera)
    return path.read_text(encoding="utf-8-sig")


def text_of(camera: Camera) -> str:
    """Text of a camera file with what a camera in memory says."""
    fields = camera.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    placement = fields.pop("transform_camera_to_body")
    flat = {f"transform_camera_to_body.{name}": value for name, value in placement.items()}
    return with_fields(f"name: {fields.pop('name')}\n", {**fields, **flat}, "lens", [])


def with_fields(text: str, fields: Mapping[str, object], kind: str, comments: list[str]) -> str:
    """The text with other values and other comments of this kind of calibration at its beginning.

    Args:
        text: of a camera file.
        fields: values by dotted name; None takes a field out.
        kind: "lens" or "mounting".
        comments: for people, a line each.
    """
    yaml = YAML()
    yaml.width = 4096
    yaml.preserve_quotes = True
    lines = [line for line in text.splitlines() if not line.startswith(f"# {kind}: ")]
    data = yaml.load("\n".join(lines) + "\n")
    for name, value in fields.items():
        *parents, last = name.split(".")
        place = data
        for parent in parents:
            place = place.setdefault(parent, CommentedMap())
        if value is None:
            place.pop(last, None)
        else:
            _put(place, last, value)
    stream = io.StringIO()
    yaml.dump(data, stream)
    return "".join(f"# {kind}: {comment}\n" for comment in comments) + stream.getvalue()


def write_camera(path: Path, text: str) -> Camera:
    """Write the text of a camera file, see `write_checked`."""
    return write_checked(path, text, Camera)


def _put(place: Any, name: str, value: object) -> None:
    if not isinstance(value, list):
        place[name] = value
        return
    old = place.get(name)
    if isinstance(old, CommentedSeq) and len(old) == len(value):
        for index, item in enumerate(value):
            old[index] = item  # keeps the comment behind it
        return
    fresh = CommentedSeq(value)
    fresh.fa.set_flow_style()
    place[name] = fresh
