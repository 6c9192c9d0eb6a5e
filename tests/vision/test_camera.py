"""Cameras: pixels to rays and back, derivatives, mounting, and what a file may say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from uasfly.camera import Camera, Placement
from uasfly.errors import FileError
from uasfly.files import find_file, load_file, shipped_names

DISTORTIONS = {
    "none": [],
    "barrel": [-0.28, 0.09, 0.0, 0.0],
    "five": [0.12, -0.6, 0.001, -0.002, 0.5],
    "rational": [0.3, 0.05, 1e-4, 2e-4, 0.01, 0.6, 0.1, 0.02],
    "prism": [-0.1, 0.02, 1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0, 1e-3, 2e-4, -1e-3, 1e-4],
    "tilted": [-0.1, 0.02, 1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 1e-4, 0.02, -0.01],
}


def camera(distortion: list[float] | None = None, **fields: object) -> Camera:
    """The shipped wide camera with other fields."""
    shipped = load_file(find_file("camera", "wide_720p"), Camera)
    return Camera.model_validate({**shipped.model_dump(), "distortion": distortion or [], **fields})


def all_cameras() -> list[Camera]:
    """One of every kind of lens."""
    fisheye = camera([0.02, -0.01, 0.003, 0.0], model="fisheye", fx=600.0, fy=610.0)
    return [*(camera(distortion) for distortion in DISTORTIONS.values()), fisheye]


@pytest.mark.parametrize("lens", all_cameras(), ids=[*DISTORTIONS, "fisheye"])
def test_every_pixel_comes_back_from_its_ray(lens: Camera) -> None:
    """Corners of the picture included."""
    u, v = np.meshgrid(np.linspace(0, lens.width_px - 1, 23), np.linspace(0, lens.height_px - 1, 17))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    rays = lens.unproject(pixels)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)
    np.testing.assert_allclose(lens.project(7.0 * rays), pixels, atol=1e-5)


@pytest.mark.parametrize("lens", all_cameras(), ids=[*DISTORTIONS, "fisheye"])
def test_the_projections_derivative_is_that_of_finite_differences(lens: Camera) -> None:
    """By central differences of 1 um."""
    points = np.array(((0.3, -0.2, 1.5), (-1.0, 0.5, 3.0), (0.01, 0.02, 0.7)))
    pixels, jacobian = lens.project_with_jacobian(points)
    np.testing.assert_allclose(pixels, lens.project(points))
    step = 1e-6
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (lens.project(points + shift) - lens.project(points - shift)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, :, axis], slope, rtol=1e-5, atol=1e-3)


def test_what_is_behind_the_camera_has_no_pixel() -> None:
    """And it does not disturb what is in front."""
    pixels = camera().project(np.array(((0.0, 0.0, -1.0), (0.0, 0.0, 2.0))))
    assert np.isnan(pixels[0]).all()
    np.testing.assert_allclose(pixels[1], (639.5, 359.5))


def test_shipped_mountings_look_where_they_say() -> None:
    """Ahead: the optical axis is the body's x. Down: it is -z, and the picture's top points to the nose."""
    ahead = load_file(find_file("camera", "wide_720p"), Camera).transform_camera_to_body.rotation
    np.testing.assert_allclose(ahead, np.array(((0, 0, 1), (-1, 0, 0), (0, -1, 0))), atol=1e-12)
    down = load_file(find_file("camera", "vga"), Camera).transform_camera_to_body.rotation
    np.testing.assert_allclose(down, np.array(((0, -1, 0), (-1, 0, 0), (0, 0, -1))), atol=1e-12)


def test_quaternion_and_angles_say_the_same() -> None:
    """Either may stand in a file."""
    by_angles = Placement(rpy_deg=(-90.0, 0.0, -90.0))
    by_quaternion = Placement(quaternion=(0.5, -0.5, 0.5, -0.5))
    np.testing.assert_allclose(by_angles.rotation, by_quaternion.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("line", "replacement", "words"),
    [
        ("fx: 914.0", "fx: -3", "fx: expected a number, above 1e-09"),
        ("fx: 914.0", "fx: 914.0\ndistortion: [0.1, 0.2]", "expected 0, 4, 5, 8, 12, 14 coefficients"),
        ("rpy_deg", "rpy_degrees", "did you mean rpy_deg?"),
        ("  rpy_deg", "  quaternion: [1, 0, 0, 1]\n  # ", "length 1.414"),
    ],
)
def test_a_wrong_camera_file_is_told_by_line_and_field(tmp_path: Path, line: str, replacement: str, words: str) -> None:
    """As every file."""
    path = tmp_path / "camera.yaml"
    path.write_text(find_file("camera", "wide_720p").read_text().replace(line, replacement))
    with pytest.raises(FileError) as caught:
        load_file(path, Camera)
    assert words in str(caught.value)
    assert "line " in str(caught.value)


def test_cameras_are_shipped() -> None:
    """By these names."""
    assert shipped_names("camera") == ["vga", "wide_720p"]
