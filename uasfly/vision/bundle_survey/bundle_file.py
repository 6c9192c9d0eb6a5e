"""A surveyed bundle as a YAML file, with how well each marker is known in its comments."""

from __future__ import annotations

import math
from pathlib import Path

from uasfly.bundle import Bundle
from uasfly.errors import FileError
from uasfly.vision.bundle_survey.survey import SurveyedMarker, SurveyResult


def bundle_text(bundle: Bundle, result: SurveyResult, camera: str, date: str) -> str:
    """The file's text.

    Args:
        bundle: of the result.
        result: for the comments.
        camera: name of the camera file.
        date: for people.
    """
    lines = [
        f"# Surveyed on {date} with camera {camera} from {len(result.views)} pictures: {result.rms_px:.3f} px RMS.",
        f"# Sigmas are relative to marker {result.origin}, the origin; they count the corners' scatter only,",
        "# not an error of the camera's calibration or of the printed sizes (1 % of size is 1 % of all distances).",
        "#   id  views  sigma x y z [mm]      sigma of rotation [deg]  RMS [px]",
        *(_comment(marker) for marker in result.markers),
        *(f"# Left out: marker {marker}: {why}" for marker, why in result.left_out.items()),
        f"name: {bundle.name}",
        f"description: {bundle.description}",
        f'family: "{bundle.family}"',
        "markers:",
    ]
    for marker in bundle.markers:
        position = ", ".join(repr(float(value)) for value in marker.position_m)
        quaternion = ", ".join(repr(float(value)) for value in marker.quaternion or (1.0, 0.0, 0.0, 0.0))
        place = f"position_m: [{position}], quaternion: [{quaternion}]"
        lines.append(f"  - {{id: {marker.id}, size_m: {marker.size_m!r}, {place}}}")
    return "\n".join(lines) + "\n"


def write_bundle(path: Path, text: str) -> None:
    """Write the file.

    Raises:
        FileError: it cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(str(path), [f"the bundle cannot be written: {error.strerror or error}"]) from None


def _comment(marker: SurveyedMarker) -> str:
    position = " ".join(f"{1000.0 * value:6.2f}" for value in marker.position_sigma_m)
    rotation = " ".join(f"{math.degrees(value):6.3f}" for value in marker.rotation_sigma_rad)
    return f"# {marker.marker_id:4d}  {marker.views:5d}  {position}  {rotation}     {marker.rms_px:8.3f}"
