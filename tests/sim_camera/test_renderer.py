from __future__ import annotations

import functools
import math
from typing import Any

import cv2
import numpy as np
import pytest

from tests.sim_camera import views
from tests.sim_camera.edges import edge_errors_px
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.sim.camera.motion import CameraMotion
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import Background, CameraSettings, Noise


def renderer(camera: Camera, bundle: Bundle, settings: CameraSettings, seed: int = 1) -> Renderer:
    """A renderer with a random generator of its own."""
    return Renderer(camera, bundle, settings, np.random.default_rng(seed))


@functools.cache
def _one_of(distortion: tuple[float, ...]) -> tuple[Camera, Bundle, CameraSettings, Renderer]:
    camera, bundle, settings = views.camera(distortion=list(distortion)), views.single(0.3), views.clean()
    return camera, bundle, settings, renderer(camera, bundle, settings)


VIEWS = {
    "straight": views.view((0.8, 0.02, -0.01)),
    "rolled": views.view((0.9, 0.0, 0.0), (0.5, 0.0, 0.0)),
    "from the side": views.view((1.0, 0.7, 0.1), (0.0, -0.05, -0.6)),
    "far": views.view((-0.6, 0.3, 0.2), (0.1, 0.05, -0.1)),
    "near a corner of the picture": views.view((1.0, 0.35, 0.22), (0.05, 0.0, 0.0)),
}


@pytest.mark.parametrize("distortion", [[], views.DISTORTED], ids=["pinhole", "distorted"])
@pytest.mark.parametrize("name", VIEWS)
def test_edges_are_where_the_camera_projects_them(name: str, distortion: list[float]) -> None:
    """The edges of the rendered black square agree with `Camera.project` to 0.02 px, on average on each side."""
    camera, bundle, settings, render = _one_of(tuple(distortion))
    image = render.render(VIEWS[name])
    corners = views.corners_in_camera(render, bundle, VIEWS[name], 5)
    # only whole cells of the border are black next to the edge: look where they are wider than the reach
    errors = edge_errors_px(image, camera, corners, settings.ink, settings.paper)
    assert len(errors) > 60
    assert abs(errors.mean()) < 0.02
    assert np.abs(errors).max() < 0.06


def test_a_marker_looks_as_opencv_draws_it() -> None:
    """Seen straight on, with eight pixels a cell, every cell has the brightness that it is printed with."""
    camera = views.camera(fx=500.0, fy=500.0, cx=319.5, cy=239.5)
    bundle, settings = (
        views.single(0.256),
        views.clean(bundle={"on": "wall", "position_m": (2.0, 0, 0), "facing_deg": 180}),
    )
    image = renderer(camera, bundle, settings).render(views.view())
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    printed = cv2.aruco.generateImageMarker(dictionary, 5, 8) > 127
    middles = image[240 - 32 + 4 : 240 + 32 : 8, 320 - 32 + 4 : 320 + 32 : 8]
    assert np.array_equal(middles > 127, printed)
    assert set(np.unique(middles)) == {round(255 * settings.ink), round(255 * settings.paper)}


def test_opencv_finds_every_marker_of_a_bundle() -> None:
    """A full picture with blur, noise, vignetting and a cluttered wall is one that a detector can use."""
    settings = views.clean(
        lens_blur_px=0.6, noise=Noise(), vignetting=0.3, background=Background(kind="clutter"), exposure_s=0.005
    )
    motion = views.view((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), np.array((0.2, 0.5, 0.0)), np.array((0.1, 0.2, 0.3)))
    image = renderer(views.camera(distortion=views.DISTORTED), views.four(), settings).render(motion)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    _, ids, _ = detector.detectMarkers(image)
    assert sorted(np.ravel(ids)) == [0, 1, 2, 3]


def test_motion_blurs_across_the_edges_and_leaves_their_middle() -> None:
    """10 px of motion to the side during the exposure widens the upright edges by it, and only these."""
    camera, bundle, settings = views.camera(exposure_s=0.01), views.single(0.3), views.clean()
    speed = 10.0 * 1.0 / camera.fx / 0.01  # 10 px at 1 m
    motion = views.view((1.0, 0.0, 0.0), velocity=np.array((0.0, speed, 0.0)))
    render = renderer(camera, bundle, settings)
    image = render.render(motion).astype(float) / 255.0
    row = image[int(camera.cy) - 70]  # in the black border below the upper edge
    corners = camera.project(views.corners_in_camera(render, bundle, motion, 5))
    left = corners[0, 0]
    column = np.arange(int(left) - 12, int(left) + 13)
    black = (settings.paper - row[column]) / (settings.paper - settings.ink)
    grey = (black > 0.02) & (black < 0.98)
    assert 9 <= grey.sum() <= 11
    middle = column[-1] + 0.5 - black.sum()
    assert middle == pytest.approx(left, abs=0.03)
    upright = image[:, int(camera.cx)]
    top = corners[0, 1]
    rows = np.arange(int(top) - 5, int(top) + 6)
    assert ((upright[rows] > settings.ink + 0.02) & (upright[rows] < settings.paper - 0.02)).sum() <= 2


def test_a_rolling_shutter_shears_what_moves() -> None:
    """Rows are exposed one after the other: moving sideways, upright edges lean by the distance moved meanwhile."""
    camera = views.camera(rolling_shutter_s=0.02)
    bundle, settings = views.single(0.3), views.clean()
    motion = views.view((1.0, 0.0, 0.0), velocity=np.array((0.0, 1.0, 0.0)))
    image = renderer(camera, bundle, settings).render(motion).astype(float) / 255.0

    def left_edge(row: int) -> float:
        black = (settings.paper - image[row, 224:250]) / (settings.paper - settings.ink)
        return float(249.5 - black.sum())

    rows = np.arange(170, 300)
    lean = np.polyfit(rows, [left_edge(row) for row in rows.tolist()], 1)[0]
    # the camera moves to its left, so what it sees moves to the right in later rows
    assert lean == pytest.approx(camera.fx * 1.0 * 0.02 / (camera.height_px - 1), abs=0.001)


def test_a_marker_seen_from_behind_or_from_the_edge_is_not_there() -> None:
    """The back of a page shows no marker, and one that is behind the camera does not appear mirrored."""
    render = renderer(views.camera(), views.single(), views.clean())
    for motion in (
        views.view((4.0, 0.0, 0.0), (0.0, 0.0, math.pi)),
        views.view((2.0, 0.5, 0.0), (0.0, 0.0, -math.pi / 2)),
        views.view((0.0, 0.0, 0.0), (0.0, 0.0, math.pi)),
    ):
        assert np.unique(render.render(motion)).tolist() == [128]


def test_a_marker_that_reaches_out_of_the_picture_is_cut_off() -> None:
    """Very near, a marker fills the picture, and nothing breaks."""
    render = renderer(views.camera(distortion=views.DISTORTED), views.single(1.0), views.clean())
    for distance in (0.5, 0.2, 0.1):
        image = render.render(views.view((2.0 - distance, 0.1, 0.0)))
        assert set(np.unique(image)) <= set(range(256))
        assert image.std() > 10.0


def test_a_small_marker_within_a_large_one_is_painted_over_it() -> None:
    """In a nested bundle both are seen."""
    bundle = Bundle.model_validate(
        {
            "name": "nested",
            "family": "aruco_4x4_50",
            "markers": [{"id": 1, "size_m": 0.05}, {"id": 0, "size_m": 0.6}],
        }
    )
    image = renderer(views.camera(), bundle, views.clean()).render(views.view((0.9, 0.0, 0.0)))
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    assert 1 in np.ravel(detector.detectMarkers(image)[1])


@pytest.mark.parametrize("kind", ["plain", "gradient", "concrete", "clutter"])
def test_backgrounds_have_their_level_and_contrast(kind: Any) -> None:
    """Each kind stays about as bright as it is told to be; all but the plain one have structure."""
    settings = views.clean(background=Background(kind=kind, level=0.4, contrast=0.2))
    motion = views.view((-3.0, 0.0, 0.0), (0.0, 0.2, 0.3))
    image = renderer(views.camera(), views.single(0.05), settings).render(motion) / 255.0
    assert image.mean() == pytest.approx(0.4, abs=0.12)
    assert (image.std() > 0.02) == (kind != "plain")


def test_a_floor_has_a_horizon() -> None:
    """Looking level over a floor there is no page above the horizon, only one brightness."""
    settings = views.clean(
        bundle={"on": "floor", "position_m": (3.0, 0.0, -1.0)}, background=Background(kind="concrete", level=0.4)
    )
    image = renderer(views.camera(), views.single(), settings).render(views.view())
    assert np.unique(image[:200]).tolist() == [round(0.4 * 255)]
    assert image[300:].std() > 3.0


def test_noise_grows_with_light() -> None:
    """Read noise where it is dark, shot noise on top where it is light; another seed draws other noise."""
    noisy = views.clean(noise=Noise(read=0.01, shot=0.04), background=Background(kind="plain", level=0.1))
    bright = noisy.model_copy(update={"background": Background(kind="plain", level=0.9)})
    away = views.view(turn=(0.0, 0.0, math.pi))
    dark = renderer(views.camera(), views.single(), noisy).render(away) / 255.0
    light = renderer(views.camera(), views.single(), bright).render(away) / 255.0
    assert dark.std() == pytest.approx(math.sqrt(0.01**2 + 0.04**2 * 0.1), rel=0.05)
    assert light.std() == pytest.approx(math.sqrt(0.01**2 + 0.04**2 * 0.9), rel=0.1)
    again = renderer(views.camera(), views.single(), noisy).render(away) / 255.0
    other = renderer(views.camera(), views.single(), noisy, seed=2).render(away) / 255.0
    assert np.array_equal(again, dark)
    assert not np.array_equal(other, dark)


def test_corners_of_the_picture_are_darker() -> None:
    """Vignetting takes its share of the light in the corners and none in the middle."""
    settings = views.clean(vignetting=0.4, background=Background(kind="plain", level=0.5))
    image = renderer(views.camera(), views.single(), settings).render(views.view(turn=(0.0, 0.0, math.pi))) / 255.0
    assert image[240, 320] == pytest.approx(0.5, abs=0.01)
    assert image[0, 0] == pytest.approx(0.3, abs=0.01)


def test_occlusions_come_and_go() -> None:
    """A share of the picture is hidden while its time lasts."""
    settings = views.clean(occlusions=[{"start_s": 1.0, "end_s": 2.0, "share": 0.25, "side": "right", "level": 0.1}])
    render = renderer(views.camera(), views.single(), settings)
    free, hidden, after = (render.render(views.view(), since_s) for since_s in (0.9, 1.0, 2.0))
    assert np.array_equal(free, after)
    assert np.unique(hidden[:, 480:]).tolist() == [26]
    assert np.array_equal(hidden[:, :480], free[:, :480])


def test_the_bundle_moves_and_the_wall_stays() -> None:
    """A scheduled displacement moves the markers by it, over the same background."""
    placement = {
        "on": "wall",
        "position_m": (2.0, 0.0, 0.0),
        "facing_deg": 180.0,
        "moves": [{"at_s": 5.0, "offset_m": (0.0, 0.5, 0.0)}],
    }
    settings = views.clean(bundle=placement, background=Background(kind="concrete"))
    render = renderer(views.camera(), views.single(), settings)
    before, after = render.render(views.view(), 4.9), render.render(views.view(), 5.0)
    changed = np.flatnonzero((before != after).any(axis=0))
    shift_px = 0.5 / 2.0 * 554.0
    assert changed.min() == pytest.approx(322.3 - shift_px - 0.125 * 277, abs=2.0)
    assert changed.max() == pytest.approx(322.3 + 0.125 * 277, abs=2.0)
    quiet = before[:, : changed.min()] == after[:, : changed.min()]
    assert quiet.all()


def test_a_family_without_a_picture_is_refused() -> None:
    """Which families can be printed is said."""
    from uasfly.errors import UasflyError

    bundle = Bundle.model_validate({"name": "s", "family": "stag_hd21", "markers": [{"id": 0, "size_m": 0.1}]})
    with pytest.raises(UasflyError, match="family stag_hd21"):
        renderer(views.camera(), bundle, views.clean())
    with pytest.raises(UasflyError, match="ids 0 to 586"):
        renderer(views.camera(), views.single(marker_id=600), views.clean())


def test_motion_follows_the_body() -> None:
    """A camera off the body's centre is carried along by its turning."""
    from uasfly.sim.camera.motion import camera_motion

    lever, rate = np.array((0.0, 0.2, 0.0)), np.array((0.0, 0.0, 2.0))
    motion: CameraMotion = camera_motion(np.zeros(3), np.zeros(3), np.eye(3), rate, lever, views.AHEAD, np.zeros(3))
    assert motion.velocity_in_world == pytest.approx([-0.4, 0.0, 0.0])
    position, rotation = motion.at(0.01)
    assert position == pytest.approx([-0.004, 0.2, 0.0])
    turned = np.array(((math.cos(0.02), -math.sin(0.02), 0.0), (math.sin(0.02), math.cos(0.02), 0.0), (0.0, 0.0, 1.0)))
    assert rotation == pytest.approx(turned @ views.AHEAD)
