"""Bundle files: several fiducial markers as one rigid body, or a single marker.

The bundle's frame is that of the printed page seen from the front: x to the right, y up, z out of the page towards the
viewer. A marker's own frame is the same about its centre. Corners are in OpenCV's order: top-left, top-right,
bottom-right, bottom-left, seen from the front with the marker upright.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from uasfly.airframe import FileModel
from uasfly.camera import Placement
from uasfly.messages import Array

Family = Literal[
    "36h11", "36h10", "25h9", "16h5",
    "aruco_4x4_50", "aruco_4x4_100", "aruco_4x4_250", "aruco_4x4_1000",
    "aruco_5x5_50", "aruco_5x5_100", "aruco_5x5_250", "aruco_5x5_1000",
    "aruco_6x6_50", "aruco_6x6_100", "aruco_6x6_250", "aruco_6x6_1000",
    "aruco_7x7_50", "aruco_7x7_100", "aruco_7x7_250", "aruco_7x7_1000",
    "aruco_original", "aruco_mip_36h12",
    "stag_hd11", "stag_hd13", "stag_hd15", "stag_hd17", "stag_hd19", "stag_hd21", "stag_hd23",
]  # fmt: skip
MarkerId = Annotated[int, Field(ge=0, le=1_000_000)]
_UNIT_CORNERS = np.array(((-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)))


class BundleMarker(Placement):
    """One marker and its place in the bundle's frame."""

    id: MarkerId
    size_m: Annotated[float, Field(ge=0.002, le=20.0, description="side of the black square")]

    @cached_property
    def corners(self) -> Array:
        """(4, 3) m, bundle frame: top-left, top-right, bottom-right, bottom-left."""
        return self.position + self.size_m * _UNIT_CORNERS @ self.rotation.T


class Bundle(FileModel):
    """Markers of one family on one rigid body."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_\-]+$")]
    description: str = ""
    family: Annotated[Family, Field(description="dictionary of the markers")]
    number: Annotated[
        MarkerId | None, Field(description="what the bundle is known by in flight; its smallest id when not given")
    ] = None
    markers: Annotated[list[BundleMarker], Field(min_length=1, max_length=1000)]

    @model_validator(mode="after")
    def _ids_are_unique(self) -> Bundle:
        ids = [marker.id for marker in self.markers]
        double = sorted({marker for marker in ids if ids.count(marker) > 1})
        if double:
            raise ValueError(f"markers: expected each id once, found id {double[0]} {ids.count(double[0])} times")
        return self

    @cached_property
    def by_id(self) -> dict[int, BundleMarker]:
        """The markers by their ids."""
        return {marker.id: marker for marker in self.markers}

    @property
    def marker_id(self) -> int:
        """Number of the bundle in a MarkerSample."""
        return min(self.by_id) if self.number is None else self.number

    def corners(self, marker_id: int) -> Array:
        """(4, 3) m, bundle frame: the marker's top-left, top-right, bottom-right, bottom-left.

        Raises:
            KeyError: when the bundle has no such marker.
        """
        return self.by_id[marker_id].corners
