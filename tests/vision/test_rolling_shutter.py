"""What a rolling shutter does to the pose of a bundle is taken out again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.vision.mounting_scene import DOWN, USUAL, fly
from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.files import find_file, load_file
from uasfly.messages import Array
from uasfly.vision.calibration.mounting.fit import fit_mounting
from uasfly.vision.calibration.mounting.model import Unknowns
from uasfly.vision.calibration.mounting.observations import Place, Sightings
from uasfly.vision.calibration.mounting.shutter import fit_through_shutter, straightened
from uasfly.vision.pose import Pose, fit_pose
from uasfly.vision.square import quaternion_of

CAMERA = load_file(find_file("camera", "vga"), Camera)
BUNDLE = load_file(find_file("bundle", "four_36h11"), Bundle)
CORNERS = np.concatenate([marker.corners for marker in BUNDLE.markers])


def moving_pose(place: Place, unknowns: Unknowns, bundle: tuple[Array, Array], after_s: float) -> Pose:
    """Bundle in camera axes so much later than the middle of the picture."""
    position = place.position[0] + after_s * place.velocity[0]
    body = place.rotation[0] @ Rotation.from_rotvec(after_s * place.rate[0]).as_matrix()
    camera, lens = body @ unknowns.camera_to_body, position + body @ unknowns.lever
    return Pose(camera.T @ (bundle[0] - lens), quaternion_of(camera.T @ bundle[1]))


def through_the_shutter(place: Place, unknowns: Unknowns, bundle: tuple[Array, Array]) -> Pose:
    """What a straight bundle is fitted to, when each corner is seen at the time of its own row."""
    later_s = np.zeros(len(CORNERS))
    for _ in range(20):
        points = [
            moving_pose(place, unknowns, bundle, float(after_s)).points(corner[None])[0]
            for corner, after_s in zip(CORNERS, later_s, strict=True)
        ]
        pixels = CAMERA.project(np.array(points))
        later_s = CAMERA.rolling_shutter_s * (pixels[:, 1] / (CAMERA.height_px - 1.0) - 0.5)
    fit = fit_pose(CAMERA, moving_pose(place, unknowns, bundle, 0.0), CORNERS, pixels, np.full(len(pixels), 0.15))
    assert fit is not None
    return fit.pose


@pytest.mark.parametrize("seed", range(4))
def test_a_bent_bundle_is_straightened(seed: int) -> None:
    """The pose's error becomes ten times smaller, whatever the motion."""
    rng = np.random.default_rng(seed)
    place = Place(
        rng.uniform((-0.2, -0.2, 1.6), (0.2, 0.2, 2.0))[None],
        Rotation.from_rotvec(rng.normal(0.0, 0.05, 3)).as_matrix()[None],
        rng.normal(0.0, 0.4, (1, 3)),
        rng.normal(0.0, 0.4, (1, 3)),
    )
    unknowns = Unknowns(DOWN.as_matrix(), np.array((0.05, 0.0, -0.05)), 0.0, 0.0, np.zeros((1, 3)), np.eye(3)[None])
    bundle = np.array((0.05, -0.05, 0.0)), Rotation.from_euler("Z", 0.4).as_matrix()
    true, bent = moving_pose(place, unknowns, bundle, 0.0), through_the_shutter(place, unknowns, bundle)
    seen = Sightings(
        np.zeros(1), np.zeros(1, dtype=np.intp), bent.position[None], bent.rotation[None], np.eye(6)[None], (0,)
    )
    straight = straightened(seen, place, unknowns, CAMERA, (BUNDLE,))
    found = Pose(straight.position[0], quaternion_of(straight.rotation[0]))
    before, after = np.abs(bent.minus(true)), np.abs(found.minus(true))
    assert before[:3].max() > 0.002
    assert before[3:].max() > 0.01
    assert after[:3].max() < 0.1 * before[:3].max()
    assert after[3:].max() < 0.1 * before[3:].max()


def test_bundles_that_are_not_known_and_global_shutters_change_nothing() -> None:
    """The sightings stay as they are, and with them the mounting."""
    flight = fly(2, duration_s=8.0)
    place = Place(*(np.zeros((len(flight.sightings.time_s), *shape)) for shape in ((3,), (3, 3), (3,), (3,))))
    unknowns = Unknowns(DOWN.as_matrix(), np.zeros(3), 0.0, 0.0, np.zeros((1, 3)), np.eye(3)[None])
    other = straightened(flight.sightings, place, unknowns, CAMERA, (BUNDLE,))  # number 0; number 3 is seen
    np.testing.assert_array_equal(other.position, flight.sightings.position)
    still = CAMERA.model_copy(update={"rolling_shutter_s": 0.0})
    plain = fit_mounting(flight.motion, flight.sightings, flight.belief(), USUAL)
    again = fit_through_shutter(flight.motion, flight.sightings, flight.belief(), still, (BUNDLE,), USUAL)
    np.testing.assert_array_equal(again.unknowns.lever, plain.unknowns.lever)
