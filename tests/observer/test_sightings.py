"""A marker as the flight sees it: where it is, how well it is known, and whether its sightings contradict it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.observer.recorded import MARKER, flying_observer, recording
from uasfly.frames import quaternion_from_euler, quaternion_product, rotation_matrix
from uasfly.messages import Array, MarkerSample
from uasfly.observer import Observer
from uasfly.observer import states as s

MOVED_S = 5.0


def moved(
    sample: MarkerSample, offset_in_world: Array, quaternion_body_to_world: Array, turn_rad: float
) -> MarkerSample:
    """The sighting of a bundle that has been moved and turned about its own normal."""
    in_body = rotation_matrix(quaternion_body_to_world).T @ offset_in_world
    turn = quaternion_from_euler(0.0, 0.0, turn_rad)
    return replace(
        sample,
        position_in_body=sample.position_in_body + in_body,
        quaternion_marker_to_body=quaternion_product(sample.quaternion_marker_to_body, turn),
    )


def fly(offset: Array, turn_rad: float = 0.0, until_s: float = 8.0, distrust_s: float = 1e9) -> Observer:
    """A recorded flight at the end of which the bundle is elsewhere; from `distrust_s` on it is not trusted."""
    flight, observer = recording(), flying_observer()
    sightings = {round(sample.time_s / 0.01): sample for sample in flight.sightings}
    for k, odometry in enumerate(flight.odometry):
        if odometry.time_s > until_s:
            break
        observer.add(odometry)
        if k * 0.01 >= distrust_s:
            observer.trust(7, False)
        if k in sightings:
            sample = sightings[k]
            observer.add(moved(sample, offset, flight.quaternion[k], turn_rad) if k * 0.01 > MOVED_S else sample)
    return observer


def test_a_marker_is_told_with_its_place_and_how_well_it_is_known() -> None:
    """Against the vehicle, so that what nobody knows of GNSS does not count; an unknown one is None."""
    observer = flying_observer()
    assert observer.marker(0.0) is None
    flight = recording()
    for k, odometry in enumerate(flight.odometry[:500]):
        observer.add(odometry)
        if k % 10 == 5:
            observer.add(flight.sightings[k // 10])
    marker = observer.marker(5.0)
    assert marker is not None
    assert marker.marker_id == 7
    np.testing.assert_allclose(marker.position_in_world, MARKER[:3], atol=0.1)
    assert marker.seen_s == pytest.approx(4.95)
    assert 0.0 < marker.position_sigma_m < 0.02
    assert 0.0 < marker.heading_sigma_rad < 0.02
    assert marker.contradiction.rejected_share < 0.2
    assert marker.contradiction.away_m < 0.1  # mostly attitude, from far away
    assert observer.marker(5.0, 8) is None


@pytest.mark.parametrize(("offset", "turn_rad"), [((0.5, 0.0, 0.0), 0.0), ((0.0, 0.0, 0.0), 0.6)])
def test_a_bundle_that_was_moved_or_turned_contradicts_itself_at_once(
    offset: tuple[float, ...], turn_rad: float
) -> None:
    """Half a second after the move, at 10 Hz: most sightings are outside the gate, and by how much is known."""
    said = fly(np.array(offset), turn_rad, until_s=MOVED_S + 0.7).marker(MOVED_S + 0.7)
    assert said is not None
    assert said.contradiction.rejected_share > 0.5
    assert said.contradiction.away_m == pytest.approx(np.linalg.norm(offset) * 0.7, abs=0.2)
    assert said.contradiction.turned_rad == pytest.approx(turn_rad * 0.7, abs=0.2)


def test_a_distrusted_marker_moves_nothing_but_is_still_looked_at() -> None:
    """The vehicle stays where GNSS and model have it, the marker where it was; it ages; trusted again it is used."""
    offset = np.array((0.5, 0.0, 0.0))
    observer = fly(offset, distrust_s=MOVED_S + 0.5)
    marker = observer.marker(8.0)
    assert marker is not None
    np.testing.assert_allclose(marker.position_in_world, MARKER[:3], atol=0.1)
    np.testing.assert_allclose(observer.moment.packed[s.POSITION], recording().position[-1], atol=0.15)  # type: ignore[union-attr]
    assert marker.seen_s < MOVED_S + 0.6
    assert marker.contradiction.away_m == pytest.approx(0.5, abs=0.1)
    observer.trust(7, True)
    last = recording().sightings[-1]
    observer.add(replace(last, time_s=7.951))
    assert observer.marker(8.0).seen_s == 7.951  # type: ignore[union-attr]


def test_a_forgotten_marker_is_taken_anew_and_the_rest_is_kept() -> None:
    """Vehicle and its covariance stay to the bit, late samples do not bring it back, the next sighting is the first."""
    offset = np.array((0.5, 0.0, 0.0))
    observer = fly(offset, until_s=MOVED_S + 0.5)
    flight = recording()
    core, covariance = observer.moment.packed[: s.CORE_NOMINAL], observer.covariance  # type: ignore[union-attr]
    observer.forget(7)
    assert observer.marker(MOVED_S + 0.5) is None
    np.testing.assert_array_equal(observer.moment.packed[: s.CORE_NOMINAL], core)  # type: ignore[union-attr]
    np.testing.assert_array_equal(observer.covariance, covariance[: s.CORE_ERROR, : s.CORE_ERROR])
    observer.forget(7)
    late = flight.odometry[round(MOVED_S / 0.01) + 40]
    observer.add(replace(late, time_s=late.time_s + 0.004))
    assert observer.marker(MOVED_S + 0.5) is None
    k = round((MOVED_S + 0.55) / 0.01)
    for odometry in flight.odometry[k - 4 : k + 1]:
        observer.add(odometry)
    observer.add(moved(flight.sightings[k // 10], offset, flight.quaternion[k], 0.0))
    marker = observer.marker(MOVED_S + 0.55)
    assert marker is not None
    assert marker.seen_s == pytest.approx(MOVED_S + 0.55)
    assert marker.contradiction.away_m == 0.0
    np.testing.assert_allclose(marker.position_in_world, MARKER[:3] + offset, atol=0.3)
