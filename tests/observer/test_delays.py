"""Measurements that come late are put where they belong."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest

from tests.observer.recorded import DT_S, flying_observer, recording
from uasfly.messages import Array, MarkerSample, OdometrySample
from uasfly.observer import Observer
from uasfly.observer.timeline import BUFFER_S

DURATION_S = 3.0


def state(observer: Observer) -> Array:
    """All that the filter knows."""
    assert observer.moment is not None
    return observer.moment.packed


def feed(samples: Sequence[OdometrySample | MarkerSample], delays_s: Array) -> Observer:
    """An observer after all samples, in the order of their arrival."""
    observer = flying_observer(DURATION_S)
    order = np.argsort([sample.time_s + delay for sample, delay in zip(samples, delays_s, strict=True)], kind="stable")
    for k in order:
        observer.add(samples[k])
    return observer


def test_odometry_in_any_order_gives_the_same_state() -> None:
    """Delays of 0 to 0.3 s at random: covariance, matching and all agree with the flight in order."""
    samples = list(recording(DURATION_S).odometry)
    delays = np.random.default_rng(0).uniform(0.0, 0.3, len(samples))
    delays[0] = 0.0
    in_order, shuffled = feed(samples, np.zeros(len(samples))), feed(samples, delays)
    assert shuffled.counters.late > 100
    assert shuffled.counters.dropped == 0
    np.testing.assert_allclose(state(shuffled), state(in_order), rtol=1e-9, atol=1e-12)


def test_sightings_with_camera_latency_give_the_same_state() -> None:
    """Marker frames 150 ms late, first sight included."""
    flight = recording(DURATION_S)
    samples = flight.in_order()
    delays = np.array([0.15 if isinstance(sample, MarkerSample) else 0.0 for sample in samples])
    in_order, late = feed(samples, np.zeros(len(samples))), feed(samples, delays)
    assert late.counters.late == len(flight.sightings)
    assert late.moment is not None
    assert late.moment.markers == (7,)
    np.testing.assert_allclose(state(late), state(in_order), rtol=1e-9, atol=1e-12)


def test_a_sample_older_than_the_buffer_is_dropped_and_counted() -> None:
    """The state does not change."""
    flight = recording(DURATION_S)
    observer = feed(list(flight.odometry), np.zeros(len(flight.odometry)))
    before = state(observer).copy()
    old = flight.odometry[round((DURATION_S - BUFFER_S - 0.1) / DT_S)]
    observer.add(dataclasses.replace(old, time_s=old.time_s + 0.5 * DT_S))
    assert observer.counters.dropped == 1
    np.testing.assert_array_equal(state(observer), before)


def test_half_a_second_is_within_the_buffer() -> None:
    """A sample 0.5 s late is used."""
    flight = recording(DURATION_S)
    missing = flight.odometry[-51]
    observer = feed([x for x in flight.odometry if x is not missing], np.zeros(len(flight.odometry) - 1))
    observer.add(missing)
    assert (observer.counters.late, observer.counters.dropped) == (1, 0)
    in_order = feed(list(flight.odometry), np.zeros(len(flight.odometry)))
    np.testing.assert_allclose(state(observer), state(in_order), rtol=1e-9, atol=1e-12)


def test_a_duplicate_changes_nothing() -> None:
    """Of odometry and of a sighting, new or old."""
    flight = recording(DURATION_S)
    samples = flight.in_order()
    observer = feed(samples, np.zeros(len(samples)))
    before = state(observer).copy()
    for sample in (flight.odometry[-1], flight.odometry[-20], flight.sightings[-1], flight.sightings[-3]):
        observer.add(sample)
    assert observer.counters.duplicates == 4
    np.testing.assert_array_equal(state(observer), before)


def test_two_markers_in_one_frame_are_no_duplicates() -> None:
    """Same time, another id."""
    flight = recording(DURATION_S)
    observer = feed(list(flight.odometry), np.zeros(len(flight.odometry)))
    observer.add(flight.sightings[-1])
    observer.add(dataclasses.replace(flight.sightings[-1], marker_id=8))
    observer.add(dataclasses.replace(flight.sightings[-1], marker_id=8))
    assert observer.counters.duplicates == 1
    assert observer.moment is not None
    assert observer.moment.markers == (7, 8)


def test_one_time_stamp_far_ahead_is_not_believed() -> None:
    """The samples that follow are used as if nothing had been."""
    flight, observer = recording(DURATION_S), flying_observer(DURATION_S)
    for k, sample in enumerate(flight.odometry):
        if k == 150:
            observer.add(dataclasses.replace(sample, time_s=sample.time_s + 1000.0))
        observer.add(sample)
    assert (observer.counters.ahead, observer.counters.dropped, observer.counters.restarts) == (1, 0, 0)
    in_order = feed(list(flight.odometry), np.zeros(len(flight.odometry)))
    np.testing.assert_array_equal(state(observer), state(in_order))


@pytest.mark.parametrize("shift_s", [-500.0, 500.0])
def test_a_clock_that_is_set_is_followed(shift_s: float) -> None:
    """Back or forward for good: the filter starts again, counted, and is right again."""
    flight, observer = recording(6.0), flying_observer(6.0)
    for sample in flight.odometry[:200]:
        observer.add(sample)
    for sample in flight.odometry[200:]:
        observer.add(dataclasses.replace(sample, time_s=sample.time_s + shift_s))
    assert observer.counters.restarts == 1
    estimate = observer.estimate(flight.duration_s + shift_s)
    assert estimate is not None
    np.testing.assert_allclose(estimate.position_in_world, flight.position[-1], atol=0.03)


def test_a_gap_of_two_seconds_is_bridged_by_the_model() -> None:
    """Not by starting again: what was known of the force is kept."""
    flight, observer = recording(6.0), flying_observer(6.0)
    for sample in [*flight.odometry[:300], *flight.odometry[500:]]:
        observer.add(sample)
    assert (observer.counters.ahead, observer.counters.restarts) == (1, 0)
    estimate = observer.estimate(flight.duration_s)
    assert estimate is not None
    np.testing.assert_allclose(estimate.position_in_world, flight.position[-1], atol=0.03)
