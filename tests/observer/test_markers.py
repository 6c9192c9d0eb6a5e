from __future__ import annotations

import numpy as np
import pytest

from tests.observer.manifold import minus_pose, plus_core, plus_pose, random_pose
from tests.observer.test_functions import covariance_of, packed_state
from uasfly.frames import quaternion_inverse, quaternion_product, rotation_matrix
from uasfly.messages import Array
from uasfly.observer import functions
from uasfly.observer import states as s
from uasfly.observer.door import Sighting
from uasfly.observer.markers import MarkerAlgebra
from uasfly.observer.sighting_gate import SCALE_MAX, SCALE_MIN
from uasfly.observer.update import GATE_6

COVARIANCE = np.diag((0.01**2,) * 3 + (0.02**2,) * 3)


def seen_from(core: Array, marker: Array) -> Array:
    """Pose (7,) of a marker relative to the body, by numpy."""
    inverse = quaternion_inverse(core[s.QUATERNION])
    position = rotation_matrix(core[s.QUATERNION]).T @ (marker[:3] - core[s.POSITION])
    return np.concatenate((position, quaternion_product(inverse, marker[3:])))


def located_from(core: Array, seen: Array) -> Array:
    """Pose (7,) in the world of a marker seen from the body, by numpy."""
    position = core[s.POSITION] + rotation_matrix(core[s.QUATERNION]) @ seen[:3]
    return np.concatenate((position, quaternion_product(core[s.QUATERNION], seen[3:])))


def algebra_of(markers: int) -> MarkerAlgebra:
    """The algebra of so many markers."""
    algebra = MarkerAlgebra()
    algebra.prepare(functions.steps(markers))
    return algebra


@pytest.mark.parametrize("markers", [0, 1])
def test_first_sight_gives_pose_covariance_and_correlation(markers: int) -> None:
    """As sampled: draw states and sightings from their distributions and locate the marker from each."""
    rng = np.random.default_rng(markers)
    old, new = s.Layout(markers), s.Layout(markers + 1)
    packed = packed_state(markers, rng)
    packed[old.covariance] *= 0.1  # small errors, so that the sampled covariance is that of the linear map
    seen = random_pose(rng)
    grown = MarkerAlgebra().first_sight(packed, markers, Sighting(0.0, 7, seen, 0.01 * COVARIANCE))
    core = packed[: s.CORE_NOMINAL]
    located = located_from(core, seen)
    np.testing.assert_allclose(grown[s.marker_nominal(markers)], located, atol=1e-12)
    np.testing.assert_array_equal(grown[: old.nominal_size], packed[old.nominal])
    np.testing.assert_array_equal(grown[new.matched.start :], packed[old.matched.start :])

    P = covariance_of(grown, new)
    np.testing.assert_array_equal(P[: old.errors, : old.errors], covariance_of(packed, old))
    errors = rng.multivariate_normal(np.zeros(old.errors), covariance_of(packed, old), 8000)
    noises = rng.multivariate_normal(np.zeros(6), 0.01 * COVARIANCE, 8000)
    marker_errors = np.array(
        [
            minus_pose(located, located_from(plus_core(core, error[: s.CORE_ERROR]), plus_pose(seen, noise)))
            for error, noise in zip(errors, noises, strict=True)
        ]
    )
    sampled = np.cov(np.concatenate((errors, marker_errors), axis=1).T)
    sigmas = np.sqrt(np.diag(P))
    assert np.abs((sampled - P) / np.outer(sigmas, sigmas)).max() < 0.06
    assert np.array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > -1e-15


def test_a_second_sighting_corrects_vehicle_and_marker_as_the_textbook_does() -> None:
    """Gain and covariance by plain algebra with Jacobians taken by finite differences."""
    rng = np.random.default_rng(3)
    layout, packed = s.Layout(2), packed_state(2, rng)
    core, marker = packed[: s.CORE_NOMINAL], packed[s.marker_nominal(1)]
    expected_view = seen_from(core, marker)
    sighting = Sighting(0.0, 7, plus_pose(expected_view, 0.01 * rng.standard_normal(6)), COVARIANCE)
    result = algebra_of(2).sighting(packed, 2, 1, sighting, 1.0, 0.0)
    H = np.zeros((6, layout.errors))
    for k in range(s.CORE_ERROR):
        step = 1e-6 * np.eye(s.CORE_ERROR)[k]
        views = [minus_pose(expected_view, seen_from(plus_core(core, sign * step), marker)) for sign in (1, -1)]
        H[:, k] = (views[0] - views[1]) / 2e-6
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        views = [minus_pose(expected_view, seen_from(core, plus_pose(marker, sign * step))) for sign in (1, -1)]
        H[:, s.marker_error(1).start + k] = (views[0] - views[1]) / 2e-6
    P = covariance_of(packed, layout)
    innovation = minus_pose(expected_view, sighting.pose)
    S = H @ P @ H.T + COVARIANCE
    error = P @ H.T @ np.linalg.solve(S, innovation)
    assert result.accepted
    assert result.nis == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-4)
    np.testing.assert_allclose(result.packed[: s.CORE_NOMINAL], plus_core(core, error[: s.CORE_ERROR]), atol=1e-6)
    for k in range(2):
        moved = plus_pose(packed[s.marker_nominal(k)], error[s.marker_error(k)])
        np.testing.assert_allclose(result.packed[s.marker_nominal(k)], moved, atol=1e-6)
    after = P - P @ H.T @ np.linalg.solve(S, H @ P)
    updated = covariance_of(result.packed, layout)
    scale = np.sqrt(np.outer(np.diag(P), np.diag(P)))
    assert np.abs((updated - after) / scale).max() < 0.05  # the reset turns the rotations by half the correction
    assert np.array_equal(updated, updated.T)


def test_a_sighting_outside_its_gate_is_refused_and_let_in_as_it_repeats() -> None:
    """The state stays, the scale of the noise grows until the gate opens."""
    rng = np.random.default_rng(4)
    packed = packed_state(1, rng)
    packed[s.Layout(1).covariance] *= 1e-3  # all doubt is in the sighting
    view = seen_from(packed[: s.CORE_NOMINAL], packed[s.marker_nominal(0)])
    sighting = Sighting(0.0, 7, plus_pose(view, np.array((3.0, 0.0, 0.0, 0.0, 0.0, 0.0))), COVARIANCE)
    algebra, scale, refused = algebra_of(1), 1.0, 0
    result = algebra.sighting(packed, 1, 0, sighting, scale, 0.1)
    while not result.accepted:
        np.testing.assert_array_equal(result.packed, packed)
        assert result.scale > scale
        scale, refused = result.scale, refused + 1
        result = algebra.sighting(packed, 1, 0, sighting, scale, 0.1)
    assert 20 < refused < 80
    assert scale < SCALE_MAX


@pytest.mark.parametrize("scale", [0.02, 0.7, 30.0])
@pytest.mark.parametrize("away_m", [0.01, 2.0])
def test_the_scale_is_matched_as_the_covariances_of_the_other_sensors_are(scale: float, away_m: float) -> None:
    """Eq. 8, 9 in the weighted form, written out: one number, shortened to the gate, R within its bounds."""
    rng = np.random.default_rng(6)
    layout, packed = s.Layout(1), packed_state(1, rng)
    core, marker = packed[: s.CORE_NOMINAL], packed[s.marker_nominal(0)]
    view = seen_from(core, marker)
    sighting = Sighting(0.0, 7, plus_pose(view, np.array((away_m, 0.0, 0.01, 0.0, 0.02, 0.0))), COVARIANCE)
    result = algebra_of(1).sighting(packed, 1, 0, sighting, scale, 0.1)
    H = np.zeros((6, layout.errors))
    for k in range(layout.errors):
        steps = [sign * 1e-6 * np.eye(layout.errors)[k] for sign in (1, -1)]
        views = [
            seen_from(
                plus_core(packed[: s.CORE_NOMINAL], d[: s.CORE_ERROR]), plus_pose(packed[s.marker_nominal(0)], d[21:])
            )
            for d in steps
        ]
        H[:, k] = (minus_pose(view, views[0]) - minus_pose(view, views[1])) / 2e-6
    R = max(scale, SCALE_MIN) * COVARIANCE
    S = H @ covariance_of(packed, layout) @ H.T + R
    innovation = result.innovation
    nis = float(innovation @ np.linalg.solve(S, innovation))
    after = R @ np.linalg.solve(S, innovation) * min(1.0, GATE_6 / nis) ** 0.5
    sample = np.outer(after, after) + R - R @ np.linalg.solve(S, R)
    matched = np.trace(np.linalg.solve(COVARIANCE, sample)) / 6.0
    assert result.nis == pytest.approx(nis, rel=1e-5)
    assert result.accepted == (nis < GATE_6)
    assert result.scale == pytest.approx(scale + 0.1 * (matched - scale), rel=1e-5)
