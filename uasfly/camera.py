"""Camera files: intrinsics with distortion, timing, and how the camera is mounted on the body.

Pixels as OpenCV counts them: the centre of the top-left pixel is (0, 0), x to the right, y down. Camera axes: x right,
y down, z forward along the optical axis. Angles are degrees in the file, because people write it, and radians behind.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from uasfly.airframe import FileModel, NonNegative, Positive
from uasfly.frames import quaternion_from_euler, rotation_matrix
from uasfly.messages import Array

_QUATERNION_TOLERANCE = 0.01  # a quaternion further from unit length is a slip
_COUNTS = {"pinhole": (0, 4, 5, 8, 12, 14), "fisheye": (0, 4)}
_CHUNK = 50_000  # points whose derivatives are held at once
_NEWTON_STEPS = 25
_CONVERGED_PX = 1e-6

Metres = Annotated[float, Field(ge=-100.0, le=100.0, allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)]
Unit = Annotated[float, Field(ge=-1.01, le=1.01, allow_inf_nan=False)]
Coefficient = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Pixels = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]


class Placement(FileModel):
    """Where something is and how it is turned: roll, pitch, yaw (Z-Y-X) or a quaternion, the identity without both."""

    position_m: tuple[Metres, Metres, Metres] = (0.0, 0.0, 0.0)
    rpy_deg: Annotated[
        tuple[Degrees, Degrees, Degrees] | None, Field(description="roll, pitch, yaw of the Z-Y-X convention")
    ] = None
    quaternion: Annotated[tuple[Unit, Unit, Unit, Unit] | None, Field(description="w, x, y, z of unit length")] = None

    @model_validator(mode="after")
    def _one_rotation(self) -> Placement:
        if self.rpy_deg is not None and self.quaternion is not None:
            raise ValueError("expected rpy_deg or quaternion, found both; keep one")
        if self.quaternion is not None and abs(math.hypot(*self.quaternion) - 1.0) > _QUATERNION_TOLERANCE:
            raise ValueError(f"expected a quaternion of length 1, found length {math.hypot(*self.quaternion):.4g}")
        return self

    @cached_property
    def position(self) -> Array:
        """(3,) m, in the frame that it is placed in."""
        return np.array(self.position_m, dtype=float)

    @cached_property
    def unit_quaternion(self) -> Array:
        """(4,) from its own axes to those that it is placed in."""
        if self.quaternion is not None:
            return np.array(self.quaternion, dtype=float) / math.hypot(*self.quaternion)
        return quaternion_from_euler(*(math.radians(angle) for angle in self.rpy_deg or (0.0, 0.0, 0.0)))

    @cached_property
    def rotation(self) -> Array:
        """(3, 3), from its own axes to those that it is placed in."""
        return rotation_matrix(self.unit_quaternion)


class Camera(FileModel):
    """One camera as it is mounted on the vehicle."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_\-]+$")]
    description: str = ""
    model: Annotated[Literal["pinhole", "fisheye"], Field(description="OpenCV's camera models")] = "pinhole"
    width_px: Annotated[int, Field(ge=16, le=20_000)]
    height_px: Annotated[int, Field(ge=16, le=20_000)]
    fx: Annotated[Positive, Field(description="focal length [px]")]
    fy: Annotated[Positive, Field(description="focal length [px]")]
    cx: Annotated[Pixels, Field(description="principal point [px], the top-left pixel's centre is 0")]
    cy: Annotated[Pixels, Field(description="principal point [px], the top-left pixel's centre is 0")]
    distortion: Annotated[
        list[Coefficient],
        Field(description="OpenCV's coefficients: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1-s4 [tau x, y]]]]; fisheye k1-k4"),
    ] = Field(default_factory=list)
    exposure_s: Annotated[float, Field(ge=0.0, le=1.0, description="time the shutter is open")] = 0.005
    latency_s: Annotated[float, Field(ge=0.0, le=2.0, description="arrival of a frame minus its mid-exposure")] = 0.0
    rolling_shutter_s: Annotated[
        float, Field(ge=0.0, le=0.2, description="first row to last row; 0 for a global shutter")
    ] = 0.0
    pixel_sigma: Annotated[
        float, Field(gt=0.0, le=10.0, description="smallest error of a marker's corner that is believed [px]")
    ] = 0.15
    transform_camera_to_body: Annotated[
        Placement, Field(description="of the optical axes (x right, y down, z forward) in the body's (FLU)")
    ]
    mounting_sigma_m: Annotated[NonNegative, Field(description="standard deviation of the mounting, an axis")] = 0.0
    mounting_sigma_deg: Annotated[float, Field(ge=0.0, le=45.0, description="the same of its rotation")] = 0.0

    @model_validator(mode="after")
    def _distortion_fits_the_model(self) -> Camera:
        counts = _COUNTS[self.model]
        if len(self.distortion) not in counts:
            expected = ", ".join(str(count) for count in counts)
            raise ValueError(
                f"distortion: expected {expected} coefficients for a {self.model} camera, found {len(self.distortion)}"
            )
        return self

    @cached_property
    def matrix(self) -> Array:
        """(3, 3) of the intrinsics [px]."""
        return np.array(((self.fx, 0.0, self.cx), (0.0, self.fy, self.cy), (0.0, 0.0, 1.0)))

    @cached_property
    def coefficients(self) -> Array:
        """(n,) of the distortion as OpenCV takes them; zeros where there is none."""
        return np.array(self.distortion or (0.0, 0.0, 0.0, 0.0), dtype=float)

    @cached_property
    def keeps_lines(self) -> bool:
        """Whether straight lines are straight in the picture: a pinhole without distortion."""
        return self.model == "pinhole" and not any(self.distortion)

    def project(self, points_in_camera: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) [m, camera axes]; NaN for what is not in front of the camera."""
        return self.project_with_jacobian(points_in_camera, want_jacobian=False)[0]

    def project_with_jacobian(self, points_in_camera: Array, *, want_jacobian: bool = True) -> tuple[Array, Array]:
        """Pixels (n, 2) of points (n, 3) [m, camera axes] and their derivatives (n, 2, 3) [px/m].

        Both are NaN for points that are not in front of the camera; the derivatives are zeros where not wanted.
        """
        points = np.asarray(points_in_camera, dtype=float).reshape(-1, 3)
        pixels = np.full((len(points), 2), np.nan)
        jacobian = np.full((len(points), 2, 3), np.nan) if want_jacobian else np.zeros((len(points), 2, 3))
        front = np.flatnonzero(points[:, 2] > 1e-9)
        for start in range(0, len(front), _CHUNK):
            chunk = front[start : start + _CHUNK]
            pixels[chunk], derivatives = self._project_front(points[chunk], want_jacobian)
            if derivatives is not None:
                jacobian[chunk] = derivatives
        return pixels, jacobian

    def unproject(self, pixels: Array) -> Array:
        """Unit rays (n, 3) [camera axes] of pixels (n, 2); NaN for pixels that no ray in front comes from.

        Newton's method on the projection: exact to 1e-6 px, where OpenCV's fixed-point iteration stops early.
        """
        target = np.asarray(pixels, dtype=float).reshape(-1, 2)
        plane = (target - (self.cx, self.cy)) / (self.fx, self.fy)
        if self.keeps_lines:
            rays = np.column_stack((plane, np.ones(len(plane))))
            return _unit(rays)
        if self.model == "fisheye":
            radius = np.linalg.norm(plane, axis=1, keepdims=True)
            plane = plane * (np.tan(np.clip(radius, 1e-9, 1.5)) / np.maximum(radius, 1e-9))
        for start in range(0, len(plane), _CHUNK):
            part = slice(start, start + _CHUNK)
            plane[part] = self._newton(plane[part], target[part])
        return _unit(np.column_stack((plane, np.ones(len(plane)))))

    def normalise(self, pixels: Array) -> Array:
        """Points (n, 2) in the plane z = 1 of an ideal camera, without distortion; NaN as in `unproject`."""
        rays = self.unproject(pixels)
        plane: Array = rays[:, :2] / rays[:, 2:]
        return plane

    def _newton(self, plane: Array, target: Array) -> Array:
        plane, active = plane.copy(), np.arange(len(plane))
        for _ in range(_NEWTON_STEPS):
            rays = np.column_stack((plane[active], np.ones(len(active))))
            found, jacobian = self.project_with_jacobian(rays)
            error = target[active] - found
            away = ~(np.abs(error).max(axis=1, initial=0.0) < _CONVERGED_PX)
            active, error, slope = active[away], error[away], jacobian[away, :, :2]
            if not len(active):
                return plane
            determinant = slope[:, 0, 0] * slope[:, 1, 1] - slope[:, 0, 1] * slope[:, 1, 0]
            with np.errstate(all="ignore"):
                plane[active, 0] += (slope[:, 1, 1] * error[:, 0] - slope[:, 0, 1] * error[:, 1]) / determinant
                plane[active, 1] += (slope[:, 0, 0] * error[:, 1] - slope[:, 1, 0] * error[:, 0]) / determinant
        plane[active] = np.nan
        return plane

    def _project_front(self, points: Array, want_jacobian: bool) -> tuple[Array, Array | None]:
        if self.keeps_lines:
            x, y, z = points.T
            pixels = np.column_stack((self.fx * x / z + self.cx, self.fy * y / z + self.cy))
            if not want_jacobian:
                return pixels, None
            zero = np.zeros_like(z)
            rows = (self.fx / z, zero, -self.fx * x / z**2, zero, self.fy / z, -self.fy * y / z**2)
            return pixels, np.stack(rows, axis=1).reshape(-1, 2, 3)
        import cv2

        still = np.zeros((3, 1))
        projection = cv2.fisheye.projectPoints if self.model == "fisheye" else cv2.projectPoints
        translation = slice(11, 14) if self.model == "fisheye" else slice(3, 6)
        found, derivatives = projection(points.reshape(-1, 1, 3), still, still, self.matrix, self.coefficients)
        jacobian = np.asarray(derivatives, dtype=float)[:, translation].reshape(-1, 2, 3) if want_jacobian else None
        return np.asarray(found, dtype=float).reshape(-1, 2), jacobian


def _unit(rays: Array) -> Array:
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True), dtype=float)
