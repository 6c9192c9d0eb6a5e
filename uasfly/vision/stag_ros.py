"""Bundle files of stag_ros (https://github.com/usrl-uofsc/stag_ros), the ROS package that the paper flew with."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from uasfly.bundle import Bundle
from uasfly.errors import FileError
from uasfly.files import find_file, load_file, top_level_fields
from uasfly.messages import Array
from uasfly.vision.square import quaternion_of
from uasfly.yaml_text import parse_yaml

_SQUARE_TOLERANCE = 0.02


def read_stag_ros(path: Path, library_hd: int = 15) -> list[Bundle]:
    """Bundles and single tags of a stag_ros file; each tag is given by three corners in the order of this project.

    Args:
        path: its YAML file.
        library_hd: of the tags, where the file does not say it (`libraryHD` stands in another file of stag_ros).

    Raises:
        FileError: it cannot be read, or a tag is no square; it names bundle and tag.
    """
    try:
        data = parse_yaml(path.read_text(encoding="utf-8"), str(path)).data
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(str(path), [f"it cannot be read: {error}"]) from None
    if not isinstance(data, dict) or not ("bundles" in data or "tags" in data):
        raise FileError(
            str(path), ["expected a bundle file of stag_ros, with tags and bundles; its parameters are in another file"]
        )
    library = data.get("libraryHD", library_hd)
    groups = [{"frame": tag.get("frame", "tag"), "tags": [tag]} for tag in _list(data, "tags") if isinstance(tag, dict)]
    groups += [group for group in _list(data, "bundles") if isinstance(group, dict)]
    bundles = []
    for group in groups:
        name = re.sub(r"[^A-Za-z0-9_\-]", "_", str(group.get("frame", "bundle"))) or "bundle"
        markers = [_marker(path, name, tag) for tag in _list(group, "tags")]
        fields = {"name": name, "family": f"stag_hd{library}", "markers": markers}
        try:
            bundles.append(Bundle.model_validate(fields))
        except ValidationError as error:
            problems = [f"{name}: {'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
            raise FileError(str(path), problems) from None
    return bundles


def find_bundle(name: str, library_hd: int = 15) -> Bundle:
    """A bundle by its shipped name or from a file, of this project or of stag_ros.

    Args:
        name: as in `uasfly.files.find_file`.
        library_hd: as in `read_stag_ros`.

    Raises:
        FileError: there is none, it cannot be used, or a file of stag_ros holds several.
    """
    path = find_file("bundle", name)
    if not {"tags", "bundles"} & top_level_fields(path):
        return load_file(path, Bundle)
    bundles = read_stag_ros(path, library_hd)
    if len(bundles) != 1:
        names = ", ".join(bundle.name for bundle in bundles) or "none"
        raise FileError(name, [f"expected one bundle in a file of stag_ros, found {names}; leave one in"])
    return bundles[0]


def _list(data: dict[Any, Any], key: str) -> list[Any]:
    value = data.get(key)
    return value if isinstance(value, list) else []


def _marker(path: Path, group: str, tag: Any) -> dict[str, Any]:
    where = f"{group}, tag {tag.get('id') if isinstance(tag, dict) else tag!r}"
    expected = "expected an id and three corners of three numbers [m]: top-left, top-right, bottom-right"
    try:
        corners: Array = np.array(tag["corners"], dtype=float)
    except (KeyError, TypeError, ValueError):
        raise FileError(str(path), [f"{where}: {expected}"]) from None
    if corners.shape != (3, 3) or not np.isfinite(corners).all() or not isinstance(tag.get("id"), int):
        raise FileError(str(path), [f"{where}: {expected}"])
    right, up = corners[1] - corners[0], corners[1] - corners[2]
    width, height = float(np.linalg.norm(right)), float(np.linalg.norm(up))
    size = 0.5 * (width + height)
    skewed = abs(width - height) > _SQUARE_TOLERANCE * size or abs(right @ up) > _SQUARE_TOLERANCE * size**2
    if size < 1e-6 or skewed:
        problem = f"its corners are no square ({width:.4f} by {height:.4f} m)"
        raise FileError(str(path), [f"{where}: {problem}; mend the corners"])
    x = right / width
    z = np.cross(x, up / height)
    z /= np.linalg.norm(z)
    rotation = np.column_stack((x, np.cross(z, x), z))
    return {
        "id": tag["id"],
        "size_m": size,
        "position_m": (0.5 * (corners[0] + corners[2])).tolist(),
        "quaternion": quaternion_of(rotation).tolist(),
    }
